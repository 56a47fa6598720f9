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
"""How long cancelled work may go on without telling of its progress before it is interrupted where it is [s]."""
_LOOK = 0.02  # how often it is looked whether it may be interrupted [s]
_WHOLE = ("<frozen importlib", "/warp/", "\\warp\\")
"""Files of code that is not interrupted: modules being imported, or kernels being built, would be left half done."""


class _CancelledError(BaseException):
    """Raised in cancelled work; nothing that handles errors stops it."""


class Background:
    """One piece of work at a time.

    Attributes:
        running: What is being done; None where nothing is.
        done: What part of it is done, from 0 to 1, of the step that it is at.
        step: That step.
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
        """Begin; False where something is being done already. ``ended`` gets the result, or what was raised, or
        neither where it was cancelled."""
        if self.running is not None:
            return False
        self._cancel.clear()
        self.running, self.done, self.step = what, 0.0, what
        self._thread = threading.Thread(target=self._run, args=(work, ended), name="studio-work", daemon=True)
        self._thread.start()
        return True

    def cancel(self) -> None:
        """End the work at the next step that it tells of, or where it is after a while, as Ctrl-C would."""
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
        except BaseException as raised:  # it is shown, whatever it is
            error = raised
        self.running, self.done, self.step = None, 0.0, ""
        ended(result, error)

    def _progress(self, what: str, done: int, total: int) -> None:
        if self._cancel.is_set():
            raise _CancelledError
        self.step, self.done = what, done / total if total else 0.0
        self._changed()

    def _interrupt(self, thread: threading.Thread | None) -> None:
        """Raise in the thread as soon as it is where that does no harm, if it still does the work."""
        while thread is not None:
            with self._guard:
                if thread is not self._thread or not self._inside or not self._cancel.is_set():
                    return
                if not _is_whole(thread):
                    _raise_in(thread, _CancelledError)
                    return
            time.sleep(_LOOK)

    def _leave(self) -> None:
        """Nothing is raised in this thread from now on."""
        with self._guard:
            self._inside = False
            _raise_in(threading.current_thread(), None)


def _is_whole(thread: threading.Thread) -> bool:
    """Whether a thread runs code that has to come to its end."""
    frame = sys._current_frames().get(thread.ident or 0)
    while frame is not None:
        if any(part in frame.f_code.co_filename for part in _WHOLE):
            return True
        frame = frame.f_back
    return False


def _raise_in(thread: threading.Thread, error: type[BaseException] | None) -> None:
    """Raise an error in a thread when it next runs Python; None takes back one that is not raised yet."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(
        ctypes.c_ulong(thread.ident or 0), None if error is None else ctypes.py_object(error)
    )
