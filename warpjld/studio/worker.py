"""Worker thread that runs the jobs of all browser windows in order, and drops waiting jobs that are superseded."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable

__all__ = ["Worker"]


class Worker:
    """Runs jobs one after another. A waiting job is replaced by a later one with the same key, so that a slider dragged
    faster than the view is drawn skips positions instead of lagging behind.

    Args:
        idle: Called when the queue becomes empty after jobs.
        failed: Called with exceptions that jobs raise.
    """

    def __init__(self, idle: Callable[[], None], failed: Callable[[BaseException], None]) -> None:
        self._idle, self._failed = idle, failed
        self._jobs: OrderedDict[Hashable, Callable[[], object]] = OrderedDict()
        self._wake = threading.Condition()
        self._running = True
        self._busy = False
        self._thread = threading.Thread(target=self._work, name="studio", daemon=True)
        self._thread.start()

    def post(self, job: Callable[[], object], key: Hashable = None) -> None:
        """Queue a job; a waiting job with the same key is dropped."""
        with self._wake:
            self._jobs[object() if key is None else key] = job
            self._wake.notify_all()

    def waits(self, key: Hashable) -> bool:
        """Whether a job with this key is waiting."""
        with self._wake:
            return key in self._jobs

    def settle(self, timeout: float = 60.0) -> bool:
        """Wait until the queue is empty; False if that takes longer than ``timeout`` [s]."""
        with self._wake:
            return self._wake.wait_for(lambda: not self._jobs and not self._busy, timeout)

    def stop(self) -> None:
        """Finish the running job and stop."""
        with self._wake:
            self._running = False
            self._wake.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout=5.0)

    def _work(self) -> None:
        while True:
            with self._wake:
                self._busy = False
                self._wake.notify_all()
                self._wake.wait_for(lambda: bool(self._jobs) or not self._running)
                if not self._running:
                    return
                _, job = self._jobs.popitem(last=False)
                self._busy = True
            for step in (job, self._idle):
                try:
                    step()
                except BaseException as error:  # nothing that a job does may end the studio
                    self._failed(error)
