"""Trials over processes: each is kept as soon as it ends, and whatever happens to a worker, it ends as a row."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import WarpjldError
from warpjld.runtime.processes import run_jobs
from warpjld.study.columns import COMMON_COLUMNS
from warpjld.study.experiment import Experiment, Outcome, generator
from warpjld.study.shards import Shard, Shards
from warpjld.tables.columns import checked_values

__all__ = ["TrialWork", "perform", "run_trials"]


def run_trials(
    experiment: Experiment, trials: Iterable[int], folder: Path, *, processes: int, done: Callable[[int, str], None]
) -> None:
    """Run trials and keep each in ``folder`` as soon as it ends.

    A trial that kills its worker twice becomes a row with status "crashed", and the rest goes on.

    Args:
        experiment: What to repeat.
        trials: Numbers of the trials to run.
        folder: Where `Shards` are kept.
        processes: Worker processes, 1 or more.
        done: Called with every finished trial and its status.

    Raises:
        WarpjldError: Workers do not even start, or a trial cannot be kept.
    """
    run_jobs(TrialWork(experiment, folder), trials, processes=processes, done=done)


@dataclass(frozen=True)
class TrialWork:
    """Trials of an experiment, kept in a folder: what a worker does."""

    experiment: Experiment
    folder: Path

    def begin(self) -> None:
        """Once in every worker."""
        self.experiment.begin()

    def do(self, trial: int) -> str:
        """Run a trial and keep it; returns its status.

        Raises:
            WarpjldError: It cannot be written, the disk being full for example.
        """
        began = time.perf_counter()
        row, outcome = perform(self.experiment, trial)
        shard = Shard(trial, row, dict(outcome.arrays), time.perf_counter() - began)
        try:
            Shards(self.folder).write(shard)
        except OSError as error:
            raise WarpjldError(f"trial {trial} cannot be kept in {self.folder}: {error}") from error
        return outcome.status

    def kept(self, trial: int) -> str | None:
        """Status of a trial that is kept already."""
        shard = Shards(self.folder).read(trial)
        return None if shard is None else str(shard.row["status"])

    def bury(self, trial: int) -> str:
        """Keep that a trial ended its process."""
        outcome = Outcome("crashed", message="the trial ended its process")
        Shards(self.folder).write(Shard(trial, _row(self.experiment, trial, outcome), {}, 0.0))
        return outcome.status


def perform(experiment: Experiment, trial: int) -> tuple[dict[str, object], Outcome]:
    """Row and outcome of a trial; a failing one is a row too."""
    try:
        outcome = experiment.run(trial, generator(experiment.seed, trial))
        return _row(experiment, trial, outcome), outcome
    except WarpjldError as error:
        outcome = Outcome("error", message=str(error))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        outcome = Outcome("error", message=f"{type(error).__name__}: {error} ({where})")
    return _row(experiment, trial, outcome), outcome


def _row(experiment: Experiment, trial: int, outcome: Outcome) -> dict[str, object]:
    """A trial's row of the table, columns in order."""
    common = {"trial": trial, "seed": f"({trial},)", "status": outcome.status, "message": outcome.message}
    values = {**experiment.plan(trial), **outcome.values}
    return {**checked_values(common, COMMON_COLUMNS), **checked_values(values, experiment.columns)}
