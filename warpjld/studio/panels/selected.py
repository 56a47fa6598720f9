"""Panel of the selected joint: its sliders, and a mark at its position; selected by name or by a click on the skin."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from warpjld.page.server import rgb
from warpjld.studio.panels.sliders import angle_slider, show_angle
from warpjld.studio.picking import digit_of, first_hit, joint_at

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["SelectedPanel"]

_NOTHING = "nothing"
_MARK = "#228be6"


class SelectedPanel:
    """Selection of a joint: a click on the skin selects the joint that moves it and puts the handle on its tip."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._sliders: dict[str, Any] = {}
        self._made_for: object = None
        self._mark: Any = None
        gui = room.server.gui
        self._folder = gui.add_folder("Selected joint")
        with self._folder:
            self.joint = gui.add_dropdown("Selected", (_NOTHING,), initial_value=_NOTHING, hint="or click the skin")
        self.joint.on_update(lambda event: room.by_hand(event, lambda: self.select(self.joint.value)))
        room.server.scene.on_click()(self._click)

    def select(self, joint: str) -> None:
        """Select a joint of the actor, put the drag handle on its digit's tip, and show its skin parameters."""
        state = self._room.state
        known = state.actor is not None and joint in state.actor.skeleton.names
        state.joint = joint if known else None
        if known:
            self._room.drag.take(digit_of(joint))
            self._room.skin.choose(joint)

    def refresh(self) -> None:
        """Update the sliders of the joint's channels and its mark."""
        state, actor = self._room.state, self._room.state.actor
        names = (_NOTHING, *({name.rpartition(".")[0]: None for name in state.channels()}))
        if tuple(self.joint.options) != names:
            self.joint.options = names
        if actor is None or state.joint not in names:
            state.joint = None
        if self.joint.value != (state.joint or _NOTHING):
            self.joint.value = state.joint or _NOTHING
        limits = {name: span for name, span in state.channels().items() if name.rpartition(".")[0] == state.joint}
        if self._made_for != (key := tuple(limits.items())):
            self._make_sliders(limits)
            self._made_for = key
        for name, degrees in state.angles().items():
            if name in self._sliders:
                show_angle(self._room, self._sliders[name], name, degrees)
        self._show_mark()

    def _make_sliders(self, limits: dict[str, tuple[float, float]]) -> None:
        for slider in self._sliders.values():
            slider.remove()
        with self._folder:
            self._sliders = {name: angle_slider(self._room, name, *span) for name, span in limits.items()}

    def _show_mark(self) -> None:
        state, actor = self._room.state, self._room.state.actor
        drawn = self._room.stage.drawn
        skin = next((shown for shown in drawn if actor is not None and shown.name == actor.name), None)
        if actor is None or skin is None or skin.joints is None or state.joint is None:
            if self._mark is not None:
                self._mark.remove()
                self._mark = None
            return
        place = skin.joints[actor.skeleton.index(state.joint)].astype(np.float32)[None]
        if self._mark is None:
            size = 0.02 * float(np.ptp(skin.vertices, axis=0).max())
            color = np.array(rgb(_MARK), np.uint8)
            self._mark = self._room.server.scene.add_point_cloud(
                "/selected", place, color, point_size=size, point_shape="circle"
            )
        elif not np.array_equal(self._mark.points, place):
            self._mark.points = place

    def _click(self, event: Any) -> None:
        origin, direction = event.ray_origin, event.ray_direction

        def pick() -> None:
            state = self._room.state
            hit = first_hit(self._room.stage.drawn, origin, direction)
            if hit is None or hit[0].name not in state.scene.actors:
                return
            if state.actor is None or state.actor.name != hit[0].name:
                state.choose(hit[0].name)
            joint = joint_at(state.scene.actors[hit[0].name], hit[1])
            self.select(joint or _NOTHING)

        self._room.post(pick)
