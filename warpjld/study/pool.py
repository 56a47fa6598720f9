"""Trials over processes. Whatever happens to a worker, every trial ends as one row."""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from warpjld.errors import WarpjldError
from warpjld.study.experiment import Experiment, Outcome
from warpjld.study.shards import Shard, Shards
from warpjld.study.worker import one_thread, ping, row_of, start, work

__all__ = ["run_trials"]

_AHEAD = 2  # trials handed out for each process: keeps it busy, and few are suspected when it dies
_LIVES = 2  # times a trial may kill a worker that has nothing else to do

Done = Callable[[int, str], None]


def run_trials(experiment: Experiment, trials: Iterable[int], folder: Path, *, processes: int, done: Done) -> None:
    """Run trials and keep each in ``folder`` as soon as it ends.

    When a worker dies (killed, out of memory, crashed), all that was handed out is run again one by one in a process
    of its own; a trial that kills it twice becomes a row with status "crashed", and the rest goes on.

    Args:
        experiment: What to repeat.
        trials: Numbers of the trials to run.
        folder: Where `Shards` are kept.
        processes: Worker processes, 1 or more.
        done: Called with every finished trial and its status.

    Raises:
        WarpjldError: Workers do not even start.
    """
    waiting = deque(trials)
    with one_thread():
        while waiting:
            suspects = _together(experiment, waiting, folder, processes, done)
            _alone(experiment, suspects, folder, done)


def _together(experiment: Experiment, waiting: deque[int], folder: Path, processes: int, done: Done) -> list[int]:
    """Work off ``waiting``; if the pool breaks, stop and return the trials that were handed out."""
    out: dict[Future[tuple[int, str]], int] = {}
    with _pool(experiment, min(processes, len(waiting))) as pool:
        try:
            while waiting or out:
                while waiting and len(out) < _AHEAD * processes:
                    trial = waiting[0]
                    out[pool.submit(work, trial, folder)] = trial
                    waiting.popleft()
                for future in wait(out, return_when=FIRST_COMPLETED).done:
                    done(*future.result())
                    del out[future]
        except BrokenProcessPool:
            # some may have been kept before the pool noticed that it is broken
            return _settle(out.values(), folder, done)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return []


def _settle(trials: Iterable[int], folder: Path, done: Done) -> list[int]:
    lost, shards = [], Shards(folder)
    for trial in sorted(trials):
        shard = shards.read(trial)
        if shard is None:
            lost.append(trial)
        else:
            done(trial, str(shard.row["status"]))
    return lost


def _alone(experiment: Experiment, suspects: list[int], folder: Path, done: Done) -> None:
    lives = dict.fromkeys(suspects, _LIVES)
    while lives:
        with _pool(experiment, 1) as pool:
            for trial in list(lives):
                try:
                    finished = pool.submit(work, trial, folder).result()
                except BrokenProcessPool:
                    lives[trial] -= 1
                    if not lives[trial]:
                        del lives[trial]
                        done(trial, _bury(experiment, trial, folder))
                    break
                del lives[trial]
                done(*finished)


def _bury(experiment: Experiment, trial: int, folder: Path) -> str:
    outcome = Outcome("crashed", message="the trial ended its process")
    Shards(folder).write(Shard(trial, row_of(experiment, trial, outcome), {}, 0.0))
    return outcome.status


def _pool(experiment: Experiment, processes: int) -> ProcessPoolExecutor:
    pool = ProcessPoolExecutor(
        processes, mp_context=multiprocessing.get_context("spawn"), initializer=start, initargs=(experiment,)
    )
    try:
        pool.submit(ping).result()
    except BrokenProcessPool as error:
        raise WarpjldError(f"study: worker processes do not start: {error}") from error
    return pool
