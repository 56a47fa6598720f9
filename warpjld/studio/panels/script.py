"""Panel with the script's text, which can be edited, and which shows edits made elsewhere in the studio."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["ScriptPanel"]


class ScriptPanel:
    """The text, an input line for commands, undo and redo."""

    def __init__(self, room: Room) -> None:
        self._room = room
        state, gui = room.state, room.server.gui
        self.steps = gui.add_button_group("Edit", ("undo", "redo"))
        self.text = gui.add_text("Script", state.document.text, multiline=True)
        with gui.add_form("One more command") as form:
            self.line = gui.add_text("Line", "")
            add = gui.add_button("Add")
        self.steps.on_click(lambda event: self._step(event.target.value))
        self.text.on_update(lambda event: room.by_hand(event, self._typed, key="text"))
        add.on_click(lambda _: form.submit())
        form.on_submit(lambda _: room.post(self._add))

    def refresh(self) -> None:
        """Update the text if it has changed."""
        if not self._room.worker.waits("text"):
            self.text.value = self._room.state.document.text

    def _step(self, which: str) -> None:
        state = self._room.state
        self._room.post(state.undo if which == "undo" else state.redo)

    def _typed(self) -> None:
        self._room.state.write(self.text.value, kind="typed")

    def _add(self) -> None:
        line = self.line.value.strip()
        if line and self._room.state.do(line):
            self.line.value = ""
