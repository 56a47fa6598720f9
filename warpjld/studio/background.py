"""Long-running work in a background thread, with progress and cancellation."""

from __future__ import annotations

import ctypes
import sys
import threading
import time
from collections.abc import Callable

__all__ = ["Background", "JobProgress"]

JobProgress = Callable[[str, int, int], None]

_PATIENCE = 1.0
"""Time after cancellation before work that reports no progress is interrupted [s]."""
_POLL = 0.02  # interval at which it is checked whether the thread may be interrupted [s]
_UNINTERRUPTIBLE = ("<frozen importlib", "/warp/", "\\warp\\")
"""Parts of file names of code that is not interrupted: imports of modules and builds of kernels must be completed."""


class _CancelledError(BaseException):
    """Raised in cancelled work; a ``BaseException``, so that handlers of ``Exception`` do not catch it."""


class Background:
    """Runs one background job at a time.

    Attributes:
        running: Name of the running job; None if there is none.
        done: Completed fraction of the current step, 0…1.
        step: Description of the current step.
    """

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._cancel = threading.Event()
        self._thread: threading.Thread | None = None
        self._inside = False
        self._guard = threading.Lock()
        self.running: str | None = None
        self.done = 0.0
        self.step = ""

    def start(
        self, what: str, work: Callable[[JobProgress], object], ended: Callable[[object, BaseException | None], None]
    ) -> bool:
        """Start a job; returns False if another one is running.

        Args:
            what: Name of the job.
            work: Function that does the job; it is given a function to report progress.
            ended: Called with the result and the exception; both are None if the job was cancelled.
        """
        if self.running is not None:
            return False
        self._cancel.clear()
        self.running, self.done, self.step = what, 0.0, what
        self._thread = threading.Thread(target=self._run, args=(work, ended), name="studio-work", daemon=True)
        self._thread.start()
        return True

    def cancel(self) -> None:
        """Stop the job at its next progress report, or after a second wherever it is, like Ctrl-C."""
        self._cancel.set()
        timer = threading.Timer(_PATIENCE, self._interrupt, (self._thread,))
        timer.daemon = True
        timer.start()

    def _run(
        self, work: Callable[[JobProgress], object], ended: Callable[[object, BaseException | None], None]
    ) -> None:
        result, error = None, None
        try:
            self._inside = True
            try:
                result = work(self._progress)
            finally:
                self._leave()
        except _CancelledError:
            self._leave()
            result = None
        except BaseException as raised:  # all exceptions are passed on to be shown
            error = raised
        self.running, self.done, self.step = None, 0.0, ""
        ended(result, error)

    def _progress(self, what: str, done: int, total: int) -> None:
        if self._cancel.is_set():
            raise _CancelledError
        self.step, self.done = what, done / total if total else 0.0
        self._changed()

    def _interrupt(self, thread: threading.Thread | None) -> None:
        """Raise ``_CancelledError`` in the thread once it is interruptible, if it still runs the job."""
        while thread is not None:
            with self._guard:
                if thread is not self._thread or not self._inside or not self._cancel.is_set():
                    return
                if not _is_uninterruptible(thread):
                    _raise_in(thread, _CancelledError)
                    return
            time.sleep(_POLL)

    def _leave(self) -> None:
        """End the interruptible part of this thread, and clear an exception that is pending."""
        with self._guard:
            self._inside = False
            _raise_in(threading.current_thread(), None)


def _is_uninterruptible(thread: threading.Thread) -> bool:
    """Whether a thread runs code that must be completed."""
    frame = sys._current_frames().get(thread.ident or 0)
    while frame is not None:
        if any(part in frame.f_code.co_filename for part in _UNINTERRUPTIBLE):
            return True
        frame = frame.f_back
    return False


def _raise_in(thread: threading.Thread, error: type[BaseException] | None) -> None:
    """Schedule an exception in a thread, raised when it next runs Python code; None clears a pending one."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(
        ctypes.c_ulong(thread.ident or 0), None if error is None else ctypes.py_object(error)
    )
