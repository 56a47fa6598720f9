"""Long-running work in a background thread, with progress and cancellation."""

from __future__ import annotations

import threading
from collections.abc import Callable

__all__ = ["Background", "JobProgress"]

JobProgress = Callable[[str, int, int], None]


class _CancelledError(BaseException):
    """Raised in the work where it tells of its progress; nothing that handles errors stops it."""


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
        """End the work at the next step that it tells of."""
        self._cancel.set()

    def _run(
        self, work: Callable[[JobProgress], object], ended: Callable[[object, BaseException | None], None]
    ) -> None:
        result, error = None, None
        try:
            result = work(self._progress)
        except _CancelledError:
            pass
        except BaseException as raised:  # it is shown, whatever it is
            error = raised
        self.running, self.done, self.step = None, 0.0, ""
        ended(result, error)

    def _progress(self, what: str, done: int, total: int) -> None:
        if self._cancel.is_set():
            raise _CancelledError
        self.step, self.done = what, done / total if total else 0.0
        self._changed()
