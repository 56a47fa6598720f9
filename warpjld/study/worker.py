"""What runs in a worker process: one trial at a time, on one thread, its result kept before it is reported."""

from __future__ import annotations

import os
import signal
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import connection, parent_process
from pathlib import Path

from warpjld.errors import WarpjldError
from warpjld.study.columns import COMMON_COLUMNS, checked_values
from warpjld.study.experiment import Experiment, Outcome, generator
from warpjld.study.shards import Shard, Shards

__all__ = ["one_thread", "perform", "ping", "row_of", "start", "work"]

_THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)

_experiment: Experiment | None = None


@contextmanager
def one_thread() -> Iterator[None]:
    """Processes spawned meanwhile compute on one thread: libraries read these variables when they load.

    Besides not fighting over cores, this is what makes sums come out in the same order everywhere.
    """
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def start(experiment: Experiment) -> None:
    """Initialise the process."""
    global _experiment
    _experiment = experiment
    experiment.begin()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's business
    threading.Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    # a pool's worker waits for work on a pipe it holds both ends of: it would outlive a killed parent for ever
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


def ping() -> int:
    """Prove that the process came up."""
    return os.getpid()


def work(trial: int, folder: Path) -> tuple[int, str]:
    """Run a trial and keep it; returns its number and status.

    Raises:
        WarpjldError: It cannot be written, the disk being full for example.
    """
    assert _experiment is not None
    began = time.perf_counter()
    row, outcome = perform(_experiment, trial)
    shard = Shard(trial, row, dict(outcome.arrays), time.perf_counter() - began)
    try:
        Shards(folder).write(shard)
    except OSError as error:
        raise WarpjldError(f"trial {trial} cannot be kept in {folder}: {error}") from error
    return trial, outcome.status


def perform(experiment: Experiment, trial: int) -> tuple[dict[str, object], Outcome]:
    """Row and outcome of a trial; a failing one is a row too."""
    try:
        outcome = experiment.run(trial, generator(experiment.seed, trial))
        return row_of(experiment, trial, outcome), outcome
    except WarpjldError as error:
        outcome = Outcome("error", message=str(error))
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}:{place.lineno}"
        outcome = Outcome("error", message=f"{type(error).__name__}: {error} ({where})")
    return row_of(experiment, trial, outcome), outcome


def row_of(experiment: Experiment, trial: int, outcome: Outcome) -> dict[str, object]:
    """A trial's row of the table, columns in order."""
    common = {"trial": trial, "seed": f"({trial},)", "status": outcome.status, "message": outcome.message}
    values = {**experiment.plan(trial), **outcome.values}
    return {**checked_values(common, COMMON_COLUMNS), **checked_values(values, experiment.columns)}
