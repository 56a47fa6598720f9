"""Panel with the curve of a channel over time, and editing of keys."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.studio.key_lines import number

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["CurvesPanel"]

_NOTHING = "—"


class CurvesPanel:
    """Graph of a channel, with buttons to move and copy the keys at the current frame and to change their splines."""

    def __init__(self, room: Room) -> None:
        from viser import uplot

        self._room = room
        gui = room.server.gui
        self.other = gui.add_number("Other frame", 0, step=1)
        self.keys = gui.add_button_group("These keys", ("move there", "copy there"))
        self.constants = gui.add_vector3(
            "T, C, B", (0.0, 0.0, 0.0), min=(-1.0,) * 3, max=(1.0,) * 3, step=0.1, hint="tension, continuity, bias"
        )
        self.spline = gui.add_button("Set splines of these keys")
        self.channel = gui.add_dropdown("Curve of", (_NOTHING,), initial_value=_NOTHING)
        nothing = np.zeros(2), np.zeros(2)
        series = uplot.Series(label="frame"), uplot.Series(label="degrees", stroke="#228be6", width=2)
        self.graph = gui.add_uplot(nothing, series, scales={"x": uplot.Scale(time=False)}, aspect=2.2, visible=False)
        self._shown: Any = None
        self.keys.on_click(lambda event: self._keys(event.target.value.split()[0].upper()))
        self.spline.on_click(lambda _: room.post(self._spline))
        self.channel.on_update(lambda event: room.by_hand(event, lambda: None, key="curve"))

    def refresh(self) -> None:
        """Show the curve."""
        state = self._room.state
        names = (_NOTHING, *state.channels())
        if tuple(self.channel.options) != names:
            self.channel.options = names
        name, actor = self.channel.value, state.actor
        visible = name != _NOTHING and actor is not None and name in names
        if self.graph.visible != visible:
            self.graph.visible = visible
        if visible and actor is not None:
            first, last = state.span
            frames = np.linspace(first, last, 4 * (last - first) + 1)
            values = np.degrees([actor.value(name, frame) for frame in frames])
            if self._shown is None or not np.array_equal(self._shown, values):
                self._shown = values
                self.graph.data = (frames, values)

    def _keys(self, what: str) -> None:
        state = self._room.state

        def act() -> None:
            if state.actor is not None:
                frames = f"{number(state.frame)} {number(self.other.value)}"
                state.do(f"KEYS {what} {frames} {state.actor.name}")

        self._room.post(act)

    def _spline(self) -> None:
        state = self._room.state
        if state.actor is not None:
            constants = " ".join(number(value) for value in self.constants.value)
            state.do(f"KEYS SPLINE {number(state.frame)} {constants} {state.actor.name}")
