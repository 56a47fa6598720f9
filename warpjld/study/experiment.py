"""What a study repeats, as the runner sees it."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from warpjld.tables.columns import Column

__all__ = ["BatchedExperiment", "Experiment", "Outcome", "generator"]


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of one trial.

    Attributes:
        status: One word for how it ended.
        values: Column → value; a missing column is an empty cell.
        arrays: Name → array, such as poses. A name has one shape throughout the study; not every trial needs it.
        message: What is worth knowing.
    """

    status: str
    values: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    message: str = ""


class Experiment(Protocol):
    """One kind of trial. It is pickled once to each worker, so it holds the plan, not what is loaded from it.

    A trial must depend on nothing but the experiment and its own number: not on what ran before it in the process.
    """

    @property
    def columns(self) -> tuple[Column, ...]:
        """Schema of ``Outcome.values``."""

    @property
    def success(self) -> str:
        """Truth column that the success rate counts."""

    @property
    def groups(self) -> tuple[str, ...]:
        """Columns whose values the summary tells apart."""

    @property
    def shown(self) -> tuple[str, ...]:
        """Number columns whose distributions the summary draws, six at most."""

    @property
    def trials(self) -> int:
        """How many trials."""

    @property
    def seed(self) -> int:
        """What all random numbers come from."""

    def plan(self, trial: int) -> dict[str, Any]:
        """Columns known before the trial is run: they are in its row even if it fails, so that failures count in the
        group they belong to."""

    def identity(self) -> dict[str, Any]:
        """All that determines the results but the number of trials, as JSON: settings, hashes of input files."""

    def begin(self) -> None:
        """Called once in every worker process, before its first trial."""

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Trial number ``trial``. Exceptions become rows with status "error"."""

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        """What is said of all trials together, as JSON for the manifest."""

    def inputs(self) -> tuple[Path, ...]:
        """Files that its trials read: what another machine must be given."""

    def moved(self, places: Mapping[Path, Path]) -> Experiment:
        """The same experiment where each of its inputs lies elsewhere."""

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """Draw a trial; may draw nothing."""


@runtime_checkable
class BatchedExperiment(Experiment, Protocol):
    """An experiment whose trials cost less where several that are alike are begun together, with the same results."""

    def alike(self, trial: int) -> Hashable:
        """The same for all trials that are."""

    def look_ahead(self, trials: Sequence[int]) -> None:
        """Called in a worker before it runs these trials, which are alike: what they have in common is computed."""


def generator(seed: int, trial: int) -> np.random.Generator:
    """The trial's own random numbers: of its number, not of the process or the order it runs in."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trial,)))
