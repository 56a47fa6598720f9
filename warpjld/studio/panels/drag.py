"""Panel for dragging fingertips and the wrist in the 3D view; inverse kinematics moves the hand within its limits."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.script.staging import stage
from warpjld.studio.key_lines import number, with_values
from warpjld.studio.reach_tips import reach_tips, reach_wrist, tips

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["DragPanel"]

_NOTHING, _WRIST = "nothing", "wrist"
_TENTH = 4  # decimals of positions [m]: a tenth of a millimetre


class DragPanel:
    """A handle on a fingertip or on the wrist. Other fingertips can be pinned: the wrist and the digits follow."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._handle: Any = None
        self._on: tuple[str, str, str] | None = None
        gui = room.server.gui
        with gui.add_folder("Drag a fingertip or the wrist", expand_by_default=False):
            self.what = gui.add_dropdown(
                "Handle on", (_NOTHING, "thumb", "index", "middle", "ring", "pinky", _WRIST), initial_value=_NOTHING
            )
            self.pinned = gui.add_checkbox(
                "Pin the other fingertips", False, hint="they stay where they are, and the wrist turns and follows"
            )
        self.what.on_update(lambda event: room.by_hand(event, lambda: None))

    def take(self, digit: str | None) -> None:
        """Put the handle on the tip of a digit, if the actor has this digit."""
        if digit in self.what.options:
            self.what.value = digit

    def refresh(self) -> None:
        """Move the handle to the fingertip or the wrist."""
        wanted = self._wanted()
        if self._handle is not None and self._on != wanted:
            self._handle.remove()
            self._handle = None
        self._on = wanted
        if wanted is None or self._room.worker.waits("drag"):
            return
        places = self._places()
        place = places[wanted[2]]
        if self._handle is None:
            length = float(np.ptp([one for name, one in places.items() if name != _WRIST], axis=0).max())
            self._handle = self._room.server.scene.add_transform_controls(
                "/tip", scale=0.5 * length, disable_rotations=True, position=tuple(place), depth_test=False
            )
            self._handle.on_update(lambda event: self._room.by_hand(event, self._drag, key="drag"))
        elif np.linalg.norm(np.array(self._handle.position) - place) > 1e-5:
            self._handle.position = tuple(place)

    def _wanted(self) -> tuple[str, str, str] | None:
        """Actor, side and digit of the handle; None without one."""
        actor, digit = self._room.state.actor, self.what.value
        if actor is None or digit == _NOTHING or actor.recorded is not None:
            return None
        side = next((side for side in ("left", "right") if digit in self._ends(side)), None)
        return None if side is None else (actor.name, side, digit)

    def _ends(self, side: str) -> dict[str, int]:
        """Joints of one side that can be dragged: fingertips by digit, and the wrist."""
        actor = self._room.state.actor
        assert actor is not None
        wrist, names = f"{side}.wrist", actor.skeleton.names
        return tips(actor, side) | ({_WRIST: names.index(wrist)} if wrist in names else {})

    def _places(self) -> dict[str, np.ndarray]:
        """World positions of the fingertips by digit, and of the wrist [m], shape (3,) each."""
        state = self._room.state
        assert state.actor is not None
        assert self._on is not None
        positions = stage(state.actor, np.array([state.frame]), state.scene.rate).positions[0]
        return {name: positions[joint] for name, joint in self._ends(self._on[1]).items()}

    def _drag(self) -> None:
        state = self._room.state
        if self._handle is None or self._on is None or state.actor is None:
            return
        _, side, name = self._on
        target, places, kind = np.array(self._handle.position, dtype=float), self._places(), ("drag", name, state.frame)
        pins = {digit: place for digit, place in places.items() if digit != _WRIST} if self.pinned.value else {}
        if name == _WRIST:
            self._move_wrist(side, target, places[_WRIST], kind)
        else:
            pins |= {name: target}
        if pins:
            found = reach_tips(state.actor, side, state.frame, pins, wrist=self.pinned.value)
            state.set_angles(found, kind=kind)

    def _move_wrist(self, side: str, target: np.ndarray, place: np.ndarray, kind: Hashable) -> None:
        """Bring the wrist to a place by the joints above it, or by moving a hand that has none."""
        state = self._room.state
        assert state.actor is not None
        above = reach_wrist(state.actor, side, state.frame, target)
        if above:
            state.set_angles(above, kind=kind)
            return
        moved = state.actor.placement.values("move", np.array([state.frame]))[0] + target - place
        what = f"MOVE {state.actor.name} {number(state.frame)}"
        values = {what: " ".join(number(value, _TENTH) for value in moved)}
        state.put(with_values(state.document.text, values), kind=kind)
