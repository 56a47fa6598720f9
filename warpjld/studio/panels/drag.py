"""Panel for dragging fingertips in the 3D view; inverse kinematics moves the hand within its limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.script.staging import stage
from warpjld.studio.reach_tips import reach_tips, tips

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["DragPanel"]

_NOTHING = "nothing"


class DragPanel:
    """A handle on a fingertip. If the wrist may move, the other fingertips are held in place."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._handle: Any = None
        self._on: tuple[str, str, str] | None = None
        gui = room.server.gui
        with gui.add_folder("Drag a fingertip", expand_by_default=False):
            self.what = gui.add_dropdown(
                "Tip", (_NOTHING, "thumb", "index", "middle", "ring", "pinky"), initial_value=_NOTHING
            )
            self.wrist = gui.add_checkbox("Wrist follows, other tips pinned", False)
        self.what.on_update(lambda event: room.by_hand(event, lambda: None))

    def take(self, digit: str | None) -> None:
        """Put the handle on the tip of a digit, if the actor has this digit."""
        if digit in self.what.options:
            self.what.value = digit

    def refresh(self) -> None:
        """Move the handle to the fingertip."""
        wanted = self._wanted()
        if self._handle is not None and self._on != wanted:
            self._handle.remove()
            self._handle = None
        self._on = wanted
        if wanted is None or self._room.worker.waits("drag"):
            return
        place = self._places()[wanted[2]]
        if self._handle is None:
            length = float(np.ptp([*self._places().values()], axis=0).max())
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
        side = next((side for side in ("left", "right") if digit in tips(actor, side)), None)
        return None if side is None else (actor.name, side, digit)

    def _places(self) -> dict[str, np.ndarray]:
        """World positions of the fingertips by digit [m], shape (3,) each."""
        state = self._room.state
        assert state.actor is not None
        assert self._on is not None
        positions = stage(state.actor, np.array([state.frame]), state.scene.rate).positions[0]
        return {digit: positions[joint] for digit, joint in tips(state.actor, self._on[1]).items()}

    def _drag(self) -> None:
        state = self._room.state
        if self._handle is None or self._on is None or state.actor is None:
            return
        _, side, digit = self._on
        target = np.array(self._handle.position, dtype=float)
        targets = self._places() | {digit: target} if self.wrist.value else {digit: target}
        found = reach_tips(state.actor, side, state.frame, targets, wrist=self.wrist.value)
        state.set_angles(found, kind=("drag", digit, state.frame))
