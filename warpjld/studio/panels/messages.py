"""Panel with the current error and the last messages."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["MessagesPanel"]

_LAST = 3  # messages shown


class MessagesPanel:
    """The current error, if there is one, and the last messages."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._shown = ""
        self._html = room.server.gui.add_html("")

    def refresh(self) -> None:
        """Update error and messages."""
        state = self._room.state
        parts = []
        if state.error is not None:
            parts.append(
                f'<div id="studio-error" style="color:#b3261e;font-weight:600">{escape(str(state.error))}</div>'
            )
        parts += [f"<div>{escape(line)}</div>" for line in [*state.messages][-_LAST:]]
        content = f'<div style="padding:0.4em 0.8em;font-size:0.8em;white-space:pre-wrap">{"".join(parts)}</div>'
        if content != self._shown:
            self._shown = self._html.content = content
