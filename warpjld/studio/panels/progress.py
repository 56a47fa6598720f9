"""Progress bar and cancel button of the running background job."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from warpjld.errors import InputError
from warpjld.studio.background import Background, JobProgress

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["ProgressPanel"]


class ProgressPanel:
    """Runs one background job at a time and shows its progress above all tabs."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self.work = Background(lambda: room.post(lambda: None, key="progress"))
        gui = room.server.gui
        self.bar = gui.add_progress_bar(0.0, visible=False)
        self.step = gui.add_markdown("", visible=False)
        self.cancel = gui.add_button("Cancel", visible=False)
        self.cancel.on_click(lambda _: self.work.cancel())

    def refresh(self) -> None:
        """Update the progress bar and the step's description."""
        running = self.work.running is not None
        for control in (self.bar, self.step, self.cancel):
            if control.visible != running:
                control.visible = running
        if running:
            self.bar.value = 100.0 * self.work.done
            self.step.content = self.work.step

    def start(
        self,
        what: str,
        work: Callable[[JobProgress], Any],
        told: Callable[[Any], object],
        failed: Callable[[BaseException], object] | None = None,
    ) -> None:
        """Start a background job; its callbacks are called on the studio's own thread.

        Args:
            what: Name of the job, for messages.
            work: Function that does the job.
            told: Called with its result.
            failed: Called with the exception, or with an :class:`InputError` if cancelled; an exception's message is
                shown in any case.

        Raises:
            InputError: Another job is running.
        """

        def show(result: object, error: BaseException | None) -> None:
            if result is None and error is None and failed is not None:
                error = InputError(f"{what} was cancelled")
            if error is not None:
                if failed is not None:
                    failed(error)
                raise error
            if result is None:
                self._room.state.messages.append(f"{what} was cancelled")
            else:
                told(result)

        busy = self.work.running
        if not self.work.start(what, work, lambda result, error: self._room.post(lambda: show(result, error))):
            raise InputError(f"{what} has to wait until {busy} has ended: Cancel ends it")
