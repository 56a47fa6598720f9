"""Rerun of one trial of a finished study: compare with the stored result, and draw it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from warpjld.errors import InputError, WarpjldError
from warpjld.files.manifest import write_json
from warpjld.runtime.processes import one_thread, worker_pool
from warpjld.study.experiment import Experiment, Outcome
from warpjld.study.pool import TrialWork, perform
from warpjld.study.run import opened

__all__ = ["Rerun", "rerun_trial"]


@dataclass(frozen=True, eq=False)
class Rerun:
    """Result of ``rerun_trial``.

    Attributes:
        row: The trial's row.
        differences: Columns and arrays that differ from the stored ones in any bit; empty if none do.
        files: The files written: the row as JSON, and pictures.
    """

    row: dict[str, Any]
    differences: tuple[str, ...]
    files: tuple[Path, ...]


def rerun_trial(
    experiment: Experiment,
    out: str | Path,
    trial: int,
    *,
    report: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> Rerun:
    """Run one trial of a study in ``out`` again, compare it with the stored result, and draw it.

    Raises:
        InputError: ``out`` holds another study, or not this trial.
        WarpjldError: The trial crashed its process.
    """
    folder = Path(out)
    if not (folder / "study.json").exists():
        raise InputError("there is no study in this folder", path=folder)
    kept = opened(experiment, folder).read(trial)
    if kept is None:
        raise InputError(f"row {trial} is not in the study in {folder}; it has rows 0 to {experiment.trials - 1}")
    report(f"trial {trial}", 0, 2)
    row, outcome = _in_a_worker(experiment, trial, folder)
    differences = [name for name in row if row[name] != kept.row.get(name)]
    for name in sorted({*outcome.arrays, *kept.arrays}):
        new, old = outcome.arrays.get(name), kept.arrays.get(name)
        if new is None or old is None or not np.array_equal(new, old, equal_nan=new.dtype.kind == "f"):
            differences.append(name)
    report(f"trial {trial}", 1, 2)
    target = folder / "rerun" / str(trial)
    target.mkdir(parents=True, exist_ok=True)
    files = [target / "row.json", *experiment.pictures(trial, outcome, target)]
    write_json(files[0], {"row": row, "differences": differences})
    report(f"trial {trial}", 2, 2)
    return Rerun(row, tuple(differences), tuple(files))


def _in_a_worker(experiment: Experiment, trial: int, folder: Path) -> tuple[dict[str, Any], Outcome]:
    """Run a trial in a single-threaded worker, as in the study."""
    # not in this process, whose libraries may add numbers on several threads in another order
    try:
        with one_thread(), worker_pool(TrialWork(experiment, folder), 1) as workers:
            outcome: tuple[dict[str, Any], Outcome] = workers.result(workers.submit(perform, experiment, trial))
            return outcome
    except BrokenProcessPool as error:
        raise WarpjldError(f"trial {trial} ended its process, as it may have done in the study") from error
