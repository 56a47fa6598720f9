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

__all__ = ["Work", "Workers", "one_thread", "run_jobs", "worker_pool"]

_AHEAD = 2  # jobs handed out for each process: keeps it busy, and few are suspected when it dies
_LIVES = 2  # times a job may kill a worker that has nothing else to do
_WATCH = 1.0  # seconds between looks at whether all workers live
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


class Workers:
    """Workers of a pool, watched over.

    A pool of Python 3.11 misses the death of a worker that it started while nothing else happened, and then waits for
    its result for ever; here deaths are looked for, too.
    """

    def __init__(self, pool: ProcessPoolExecutor) -> None:
        self._pool = pool
        self._others = set(multiprocessing.active_children())
        self._alive: set[BaseProcess] = set()

    def submit(self, do: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Hand out work; this is when workers are started: they never hear of Ctrl-C, not even while they import, and
        none is left half started, which would end in a traceback."""
        block = hasattr(signal, "pthread_sigmask")
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM}) if block else set()
        try:
            future = self._pool.submit(do, *arguments)
            self._alive |= self._now()
            return future
        finally:
            if block:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def finished(self, futures: Iterable[Future[Any]]) -> set[Future[Any]]:
        """Those that are done, once one is.

        Raises:
            BrokenProcessPool: A worker has died.
        """
        while not (done := wait(futures, timeout=_WATCH, return_when=FIRST_COMPLETED).done):
            now = self._now()
            if self._alive - now:
                raise BrokenProcessPool("a worker process ended")
            self._alive |= now
        return done

    def result(self, future: Future[Any]) -> Any:
        """Result of one future; raises as ``finished`` does, and what its work raised."""
        self.finished([future])
        return future.result()

    def end(self) -> None:
        """End workers, those that do not go by force."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        workers = self._now()
        for worker in workers:
            worker.terminate()
        for worker in workers:
            worker.join(_PATIENCE)
            if worker.is_alive():
                worker.kill()

    def _now(self) -> set[BaseProcess]:
        return set(multiprocessing.active_children()) - self._others


@contextmanager
def worker_pool(work: Work[Any], processes: int) -> Iterator[Workers]:
    """Workers that have begun; left by an exception, they are ended, whatever they are doing.

    Let ``BrokenProcessPool`` leave it too: the pool waits for its workers for ever where one was started while the
    pool was ending the others, or does not heed being asked.

    Raises:
        WarpjldError: They do not start.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=spawn, initializer=_start, initargs=(work,)) as pool:
        workers = Workers(pool)
        try:
            try:
                workers.result(workers.submit(os.getpid))
            except BrokenProcessPool as error:
                raise WarpjldError(f"worker processes do not start: {error}") from error
            yield workers
        except BaseException:
            workers.end()
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
    # what is raised here may come to nothing: in a destructor, or just as a job ends
    signal.alarm(int(_PATIENCE))
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


def _together(work: Work[Job], waiting: deque[Job], processes: int, done: Callable[[Job, str], None]) -> list[Job]:
    """Work off ``waiting``; if the pool breaks, stop and return the jobs that were handed out."""
    out: dict[Future[str], Job] = {}
    try:
        with worker_pool(work, min(processes, len(waiting))) as workers:
            while waiting or out:
                while waiting and len(out) < _AHEAD * processes:
                    job = waiting[0]
                    out[workers.submit(_do, job)] = job
                    waiting.popleft()
                for future in workers.finished(out):
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
        try:
            with worker_pool(work, 1) as workers:
                while lives:
                    job, left = lives[0]
                    status = workers.result(workers.submit(_do, job))
                    del lives[0]
                    done(job, status)
        except BrokenProcessPool:
            lives[0] = (job, left - 1)
            if left == 1:
                del lives[0]
                done(job, work.bury(job))
