"""Protocol of experiments: what the study runner needs of the trials that it repeats."""

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
        status: How it ended, as a short word.
        values: Values by column; a missing column becomes an empty cell.
        arrays: Arrays by name, such as poses. Arrays of one name have the same shape in all trials that have them.
        message: Remark for the table.
    """

    status: str
    values: Mapping[str, Any] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    message: str = ""


class Experiment(Protocol):
    """One kind of trial. It is pickled to each worker, so it should hold the plan, not data loaded from it.

    A trial may depend only on the experiment and the trial's number, not on what ran before it in the process.
    """

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of ``Outcome.values``."""

    @property
    def success(self) -> str:
        """Name of the truth column that the success rate counts."""

    @property
    def groups(self) -> tuple[str, ...]:
        """Columns by whose values the summary groups success rates."""

    @property
    def shown(self) -> tuple[str, ...]:
        """Number columns whose distributions the summary draws, at most six."""

    @property
    def trials(self) -> int:
        """Number of trials."""

    @property
    def seed(self) -> int:
        """Seed of all random numbers."""

    def plan(self, trial: int) -> dict[str, Any]:
        """Columns known before a trial is run. They are in its row even if it fails, so that failures are counted in
        their group."""

    def identity(self) -> dict[str, Any]:
        """Everything but the number of trials that determines the results, as JSON: settings, hashes of inputs."""

    def begin(self) -> None:
        """Called once in every worker process, before its first trial."""

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        """Run trial number ``trial``. Exceptions become rows with status "error"."""

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        """Results about all trials together, as JSON for the manifest."""

    def inputs(self) -> tuple[Path, ...]:
        """Files that the trials read, which other machines must be sent."""

    def moved(self, places: Mapping[Path, Path]) -> Experiment:
        """Copy that reads its inputs from other paths."""

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        """Draw a trial; the files written, which may be none."""


@runtime_checkable
class BatchedExperiment(Experiment, Protocol):
    """An experiment that can compute similar trials in a batch, with the same results as one by one."""

    def alike(self, trial: int) -> Hashable:
        """Key of a trial; trials with equal keys can be batched."""

    def look_ahead(self, trials: Sequence[int]) -> None:
        """Called in a worker before it runs these trials, which have equal keys, to compute them in a batch."""


def generator(seed: int, trial: int) -> np.random.Generator:
    """Random generator of a trial; it depends on its number only, not on processes or order."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trial,)))
