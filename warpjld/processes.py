"""Jobs over processes. Whatever happens to a worker, every job ends with a status."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import connection, parent_process
from multiprocessing.process import BaseProcess
from typing import Any, Protocol, TypeVar

from warpjld.errors import WarpjldError

__all__ = ["Work", "one_thread", "run_jobs", "worker_pool"]

_AHEAD = 2  # jobs handed out for each process: keeps it busy, and few are suspected when it dies
_LIVES = 2  # times a job may kill a worker that has nothing else to do
_PATIENCE = 5.0  # seconds that a worker has to put away what it was writing

_THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


Job = TypeVar("Job", contravariant=True)


class Work(Protocol[Job]):
    """One kind of job; it is pickled once to each worker. Results are kept on disk, by the worker itself."""

    def begin(self) -> None:
        """Called once in every worker, before its first job."""

    def do(self, job: Job) -> str:
        """Do a job in a worker and keep what comes of it; returns its status."""

    def kept(self, job: Job) -> str | None:
        """Status of a job whose result is kept already, else None."""

    def bury(self, job: Job) -> str:
        """Keep that a job ended its process, twice; returns its status."""


def run_jobs(work: Work[Job], jobs: Iterable[Job], *, processes: int, done: Callable[[Job, str], None]) -> None:
    """Do jobs.

    When a worker dies (killed, out of memory, crashed), all that was handed out is done again one by one in a process
    of its own; a job that kills it twice is buried, and the rest goes on.

    Args:
        work: What is done.
        jobs: What it is done to.
        processes: Workers, 1 or more.
        done: Called with every finished job and its status.

    Raises:
        WarpjldError: Workers do not even start, or what ``Work.do`` raises.
        KeyboardInterrupt: As soon as it comes: jobs that are being done are given up.
    """
    waiting = deque(jobs)
    with one_thread():
        while waiting:
            suspects = _together(work, waiting, processes, done)
            _alone(work, suspects, done)


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


@contextmanager
def worker_pool(work: Work[Any], processes: int) -> Iterator[ProcessPoolExecutor]:
    """Workers that have begun; left by an exception, they are ended, whatever they are doing.

    Raises:
        WarpjldError: They do not start.
    """
    before = set(multiprocessing.active_children())
    with ProcessPoolExecutor(
        processes, mp_context=multiprocessing.get_context("spawn"), initializer=_start, initargs=(work,)
    ) as pool:
        try:
            try:
                _submit(pool, os.getpid).result()
            except BrokenProcessPool as error:
                raise WarpjldError(f"worker processes do not start: {error}") from error
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            _end(set(multiprocessing.active_children()) - before)
            raise


_work: Work[Any] | None = None


def _start(work: Work[Any]) -> None:
    """Initialise a worker."""
    global _work
    _work = work
    work.begin()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's business
    signal.signal(signal.SIGTERM, _ended)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    threading.Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    # a pool's worker waits for work on a pipe it holds both ends of: it would outlive a killed parent for ever
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


_doing = False


def _ended(*_: object) -> None:
    if not _doing:
        os._exit(1)
    raise SystemExit(1)  # lets whoever writes a file remove what is half of it


def _do(job: Any) -> str:
    global _doing
    assert _work is not None
    _doing = True
    try:
        return _work.do(job)
    except SystemExit:
        os._exit(1)  # a pool would take it for the job's result and go on
    finally:
        _doing = False


def _submit(pool: ProcessPoolExecutor, do: Callable[..., Any], *arguments: Any) -> Future[Any]:
    """Hand out work; this is when workers are started: they never hear of Ctrl-C, not even while they import, and none
    is left half started, which would end in a traceback."""
    if not hasattr(signal, "pthread_sigmask"):
        return pool.submit(do, *arguments)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        return pool.submit(do, *arguments)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _end(workers: Iterable[BaseProcess]) -> None:
    """End workers, those that do not go by force."""
    workers = list(workers)
    for worker in workers:
        worker.terminate()
    for worker in workers:
        worker.join(_PATIENCE)
        if worker.is_alive():
            worker.kill()


def _together(work: Work[Job], waiting: deque[Job], processes: int, done: Callable[[Job, str], None]) -> list[Job]:
    """Work off ``waiting``; if the pool breaks, stop and return the jobs that were handed out."""
    out: dict[Future[str], Job] = {}
    with worker_pool(work, min(processes, len(waiting))) as pool:
        try:
            while waiting or out:
                while waiting and len(out) < _AHEAD * processes:
                    job = waiting[0]
                    out[_submit(pool, _do, job)] = job
                    waiting.popleft()
                for future in wait(out, return_when=FIRST_COMPLETED).done:
                    done(out[future], future.result())
                    del out[future]
        except BrokenProcessPool:
            return _settle(work, out.values(), done)
    return []


def _settle(work: Work[Job], jobs: Iterable[Job], done: Callable[[Job, str], None]) -> list[Job]:
    """Jobs that were lost; some may have been kept before the pool noticed that it is broken."""
    lost = []
    for job in jobs:
        status = work.kept(job)
        if status is None:
            lost.append(job)
        else:
            done(job, status)
    return lost


def _alone(work: Work[Job], suspects: list[Job], done: Callable[[Job, str], None]) -> None:
    lives = [(job, _LIVES) for job in suspects]
    while lives:
        with worker_pool(work, 1) as pool:
            while lives:
                job, left = lives[0]
                try:
                    status = _submit(pool, _do, job).result()
                except BrokenProcessPool:
                    lives[0] = (job, left - 1)
                    if left == 1:
                        del lives[0]
                        done(job, work.bury(job))
                    break
                del lives[0]
                done(job, status)
