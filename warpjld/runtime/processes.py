"""Parallel jobs in worker processes; every job ends with a status, even if its worker crashes."""

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
from typing import Any, Protocol, TypeVar, runtime_checkable

from warpjld.errors import WarpjldError

__all__ = ["LIVES", "THREAD_VARIABLES", "BlockWork", "Work", "Workers", "one_thread", "run_jobs", "worker_pool"]

_AHEAD = 2  # jobs submitted per process: keeps it busy, and leaves few to suspect after a crash
LIVES = 2  # number of crashes of a worker on its own after which a job is given up
_WATCH = 1.0  # interval of checks whether all workers are alive [s]
_PATIENCE = 5.0  # time for a terminated worker to remove temporary files [s]

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


Job = TypeVar("Job", contravariant=True)
Each = TypeVar("Each")


class Work(Protocol[Job]):
    """A kind of job, pickled once to each worker. Workers store results on disk themselves."""

    def begin(self) -> None:
        """Called once in every worker, before its first job."""

    def do(self, job: Job) -> str:
        """Do a job in a worker and store its result; returns its status."""

    def kept(self, job: Job) -> str | None:
        """Status of a job whose result is stored already, else None."""

    def bury(self, job: Job) -> str:
        """Record that a job crashed its process repeatedly; returns its status."""


@runtime_checkable
class BlockWork(Work[Each], Protocol[Each]):
    """Jobs that are faster in blocks, with the same results."""

    def blocks(self, jobs: Iterable[Each], processes: int) -> Iterable[list[Each]]:
        """Divide jobs into blocks, each of which is given to one worker."""

    def do_block(self, jobs: list[Each]) -> list[str]:
        """Do the jobs of a block in a worker and store their results; returns their statuses."""


def run_jobs(work: Work[Job], jobs: Iterable[Job], *, processes: int, done: Callable[[Job, str], None]) -> None:
    """Run jobs in worker processes, in blocks where ``work`` is a ``BlockWork``.

    If a worker dies (killed, out of memory, crashed), all submitted jobs are repeated one by one in a process of their
    own; a job that crashes it twice is recorded as crashed, and the others continue.

    Args:
        work: The kind of job.
        jobs: The jobs.
        processes: Number of workers, 1 or more.
        done: Called with every finished job and its status.

    Raises:
        WarpjldError: Workers do not start, or an error raised by ``Work.do``.
        KeyboardInterrupt: Immediately; running jobs are abandoned.
    """
    waiting = deque(work.blocks(jobs, processes) if isinstance(work, BlockWork) else ([job] for job in jobs))
    with one_thread():
        while waiting:
            suspects = _together(work, waiting, processes, done)
            _alone(work, suspects, done)


@contextmanager
def one_thread() -> Iterator[None]:
    """Context in which spawned processes use one thread for numerical libraries, by environment variables.

    This avoids contention for cores, and makes the order of summation reproducible.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


class Workers:
    """The workers of a pool, with supervision.

    A pool of Python 3.11 does not notice the death of a worker that was started while the pool was idle, and waits for
    its result for ever; therefore workers are checked here, too.
    """

    def __init__(self, pool: ProcessPoolExecutor) -> None:
        self._pool = pool
        self._others = set(multiprocessing.active_children())
        self._alive: set[BaseProcess] = set()

    def submit(self, do: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submit a job. Workers are started here with signals blocked: they never receive Ctrl-C, not even during
        imports, and starting one is not interrupted half-way, which would cause a traceback."""
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
        """The finished futures, as soon as there is one.

        Raises:
            BrokenProcessPool: A worker died.
        """
        while not (done := wait(futures, timeout=_WATCH, return_when=FIRST_COMPLETED).done):
            now = self._now()
            if self._alive - now:
                raise BrokenProcessPool("a worker process ended")
            self._alive |= now
        return done

    def result(self, future: Future[Any]) -> Any:
        """Result of one future; raises as ``finished`` does, and the job's own errors."""
        self.finished([future])
        return future.result()

    def end(self) -> None:
        """Terminate the workers, and kill those that do not end."""
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
    """Context with started workers; they are terminated when it is left by an exception.

    ``BrokenProcessPool`` must leave the context, too: otherwise the pool may wait for ever for a worker that was
    started while the pool was terminating the others, or that ignores the termination.

    Raises:
        WarpjldError: Workers do not start.
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
    """Initialise a worker process."""
    global _work
    _work = work
    work.begin()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    signal.signal(signal.SIGTERM, _ended)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    threading.Thread(target=_die_with_parent, daemon=True).start()


def _die_with_parent() -> None:
    # a pool's worker waits on a pipe of which it holds both ends: it would outlive a killed parent
    parent = parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


_doing = False


def _ended(*_: object) -> None:
    if not _doing:
        os._exit(1)
    # the exception may be swallowed, in a destructor or at the end of a job: the alarm ends the process then
    signal.alarm(int(_PATIENCE))
    raise SystemExit(1)  # lets the writer of a file remove its temporary file


def _do(job: Any) -> str:
    global _doing
    assert _work is not None
    _doing = True
    try:
        return _work.do(job)
    except SystemExit:
        os._exit(1)  # a pool would return it as the job's result and go on
    finally:
        _doing = False


def _do_block(jobs: list[Any]) -> list[str]:
    global _doing
    assert _work is not None
    _doing = True
    try:
        return _work.do_block(jobs) if isinstance(_work, BlockWork) else [_work.do(job) for job in jobs]
    except SystemExit:
        os._exit(1)
    finally:
        _doing = False


def _together(
    work: Work[Job], waiting: deque[list[Job]], processes: int, done: Callable[[Job, str], None]
) -> list[Job]:
    """Run ``waiting`` blocks in a pool; if it breaks, return the submitted jobs without a result."""
    out: dict[Future[list[str]], list[Job]] = {}
    try:
        with worker_pool(work, min(processes, len(waiting))) as workers:
            while waiting or out:
                while waiting and len(out) < _AHEAD * processes:
                    block = waiting[0]
                    out[workers.submit(_do_block, block)] = block
                    waiting.popleft()
                for future in workers.finished(out):
                    for job, status in zip(out[future], future.result(), strict=True):
                        done(job, status)
                    del out[future]
    except BrokenProcessPool:
        return _settle(work, [job for block in out.values() for job in block], done)
    return []


def _settle(work: Work[Job], jobs: Iterable[Job], done: Callable[[Job, str], None]) -> list[Job]:
    """Jobs without a stored result; others may have finished before the pool noticed that it is broken."""
    lost = []
    for job in jobs:
        status = work.kept(job)
        if status is None:
            lost.append(job)
        else:
            done(job, status)
    return lost


def _alone(work: Work[Job], suspects: list[Job], done: Callable[[Job, str], None]) -> None:
    lives = [(job, LIVES) for job in suspects]
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
