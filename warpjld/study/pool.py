"""Running trials in worker processes; each is written as soon as it ends, and a trial that crashes becomes a row."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import WarpjldError
from warpjld.runtime.processes import run_jobs
from warpjld.study.columns import COMMON_COLUMNS
from warpjld.study.experiment import BatchedExperiment, Experiment, Outcome, generator
from warpjld.study.shards import Shard, Shards
from warpjld.tables.columns import checked_values

__all__ = ["TrialWork", "perform", "performed", "run_trials"]

_TOGETHER = 32  # largest number of similar trials in a block
_SHARES = 4  # smallest number of blocks per process


def run_trials(
    experiment: Experiment, trials: Iterable[int], folder: Path, *, processes: int, done: Callable[[int, str], None]
) -> None:
    """Run trials and write each to ``folder`` as soon as it ends.

    A trial that kills its worker twice becomes a row with status "crashed"; the others continue.

    Args:
        experiment: The experiment.
        trials: Numbers of the trials to run.
        folder: Folder of the `Shards`.
        processes: Number of worker processes, 1 or more.
        done: Called with every finished trial and its status.

    Raises:
        WarpjldError: Workers cannot be started, or a trial cannot be written.
    """
    run_jobs(TrialWork(experiment, folder), trials, processes=processes, done=done)


@dataclass(frozen=True)
class TrialWork:
    """The work of a worker process: run trials of an experiment and write them to a folder."""

    experiment: Experiment
    folder: Path

    def begin(self) -> None:
        """Called once in every worker."""
        self.experiment.begin()

    def do(self, trial: int) -> str:
        """Run a trial and write it; its status.

        Raises:
            WarpjldError: It cannot be written, for example because the disk is full.
        """
        shard = performed(self.experiment, trial)
        try:
            Shards(self.folder).write(shard)
        except OSError as error:
            raise WarpjldError(f"trial {trial} cannot be written to {self.folder}: {error}") from error
        return str(shard.row["status"])

    def blocks(self, trials: Iterable[int], processes: int) -> list[list[int]]:
        """Blocks of similar trials, small enough that every process gets several; ordered by their first trial."""
        order = list(trials)
        most = min(_TOGETHER, max(1, len(order) // (_SHARES * processes)))
        if not isinstance(self.experiment, BatchedExperiment) or most == 1:
            return [[trial] for trial in order]
        alike: dict[Hashable, list[int]] = {}
        for trial in order:
            alike.setdefault(self.experiment.alike(trial), []).append(trial)
        blocks = [group[k : k + most] for group in alike.values() for k in range(0, len(group), most)]
        return sorted(blocks)

    def do_block(self, trials: list[int]) -> list[str]:
        """Run a block of similar trials and write each."""
        if isinstance(self.experiment, BatchedExperiment) and len(trials) > 1:
            self.experiment.look_ahead(trials)
        return [self.do(trial) for trial in trials]

    def kept(self, trial: int) -> str | None:
        """Status of a trial that is on disk, else None."""
        shard = Shards(self.folder).read(trial)
        return None if shard is None else str(shard.row["status"])

    def bury(self, trial: int) -> str:
        """Write a row with status "crashed" for a trial that ended its process."""
        outcome = Outcome("crashed", message="the trial ended its process")
        Shards(self.folder).write(Shard(trial, _row(self.experiment, trial, outcome), {}, 0.0))
        return outcome.status


def performed(experiment: Experiment, trial: int) -> Shard:
    """Run a trial; its shard."""
    began = time.perf_counter()
    row, outcome = perform(experiment, trial)
    return Shard(trial, row, dict(outcome.arrays), time.perf_counter() - began)


def perform(experiment: Experiment, trial: int) -> tuple[dict[str, object], Outcome]:
    """Run a trial; its row and outcome, with status "error" if it raised an exception."""
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
    """A trial's row of the table, with checked values in the order of the columns."""
    common = {"trial": trial, "seed": f"({trial},)", "status": outcome.status, "message": outcome.message}
    values = {**experiment.plan(trial), **outcome.values}
    return {**checked_values(common, COMMON_COLUMNS), **checked_values(values, experiment.columns)}
