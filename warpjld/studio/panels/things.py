"""Panel for objects: add, move with a handle, grasp."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.script.props import Prop, prop_places
from warpjld.studio.key_lines import number, with_values
from warpjld.studio.panels.grasps import GraspsPanel

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["ThingsPanel"]

_NOTHING = "—"
_SIZES = {"ball": "0.065", "box": "0.05 0.05 0.05", "cylinder": "0.05 0.1", "plate": "", "glass": ""}
"""Sizes [m] of the objects that this panel adds, suitable for a hand."""
_TENTH = 4  # decimals of positions [m]: a tenth of a millimetre


class ThingsPanel:
    """Objects on the stage."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._handle: Any = None
        self._on: str | None = None
        gui = room.server.gui
        with gui.add_folder("Objects", expand_by_default=False):
            self.shape = gui.add_dropdown("Shape", tuple(_SIZES), initial_value="ball")
            self.add = gui.add_button("Bring on")
            self.which = gui.add_dropdown("Object", (_NOTHING,), initial_value=_NOTHING)
            self.grasps = GraspsPanel(room)
        self.add.on_click(lambda _: room.post(self._add))
        self.which.on_update(lambda event: room.by_hand(event, lambda: None))

    def refresh(self) -> None:
        """Put the handle where the object is."""
        self.grasps.refresh()
        scene = self._room.state.scene
        names = (_NOTHING, *scene.props)
        if tuple(self.which.options) != names:
            self.which.options = names
        wanted = self.which.value if self.which.value in scene.props else None
        if self._handle is not None and self._on != wanted:
            self._handle.remove()
            self._handle = None
        self._on = wanted
        if wanted is None or self._room.worker.waits("thing"):
            return
        prop = scene.props[wanted]
        place = self._place(prop)
        if self._handle is None:
            size = float(np.ptp(prop.thing.vertices, axis=0).max())
            self._handle = self._room.server.scene.add_transform_controls(
                "/thing", scale=size, disable_rotations=True, position=tuple(place), depth_test=False
            )
            self._handle.on_update(lambda event: self._room.by_hand(event, self._move, key="thing"))
        elif np.linalg.norm(np.array(self._handle.position) - place) > 1e-4:
            self._handle.position = tuple(place)

    def _place(self, prop: Prop) -> np.ndarray:
        """Where an object is at the frame [m], shape (3,)."""
        state = self._room.state
        return prop_places(state.scene.actors, state.scene.rate, prop, np.array([state.frame])).position[0]

    def _move(self) -> None:
        state = self._room.state
        prop = state.scene.props.get(self._on or "")
        if prop is None or self._handle is None:
            return
        keyed = prop.placement.values("move", np.array([state.frame]))[0]
        way = keyed + np.array(self._handle.position, dtype=float) - self._place(prop)
        what = f"MOVE {prop.name} {number(state.frame)}"
        text = with_values(state.document.text, {what: " ".join(number(v, _TENTH) for v in way)})
        state.put(text, kind=("thing", prop.name, state.frame))

    def _add(self) -> None:
        state = self._room.state
        shape = self.shape.value
        count = next(k for k in range(1, 1000) if f"{shape}{k}".upper() not in state.scene.props)
        if state.do(f"OBJECT {shape}{count} {shape} {_SIZES[shape]}".upper().rstrip()):
            self.which.options = (_NOTHING, *state.scene.props)
            self.which.value = f"{shape}{count}".upper()
