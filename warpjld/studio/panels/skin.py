"""Panel with sliders for the covering's parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from warpjld.studio.key_lines import number, with_values

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["SkinPanel"]

_RANGES = {"inflation": (0.0, 2.0), "muscle": (0.0, 1.0), "peak": (0.05, 0.95), "palm": (0.0, 6.0)}
_NEAR = ("Proximity after", "Proximity before")  # for the segments that begin and end at the joint
_HALF = 0.5  # largest proximity: each joint of a segment may round half of it
_ALL = "ALL"


class SkinPanel:
    """Sliders for the parameters of one joint, or of all joints."""

    def __init__(self, room: Room) -> None:
        self._room = room
        gui = room.server.gui
        with gui.add_folder("Skin at a joint", expand_by_default=False):
            self.joint = gui.add_dropdown("Joint", (_ALL,), initial_value=_ALL)
            self.sliders = {name: self._slider(name, *_RANGES[name]) for name in _RANGES}
            self.near = [self._near(label) for label in _NEAR]
        self.joint.on_update(lambda event: room.by_hand(event, lambda: None))

    def choose(self, joint: str) -> None:
        """Choose the joint whose parameters are shown."""
        if joint in self.joint.options:
            self.joint.value = joint

    def refresh(self) -> None:
        """Update the values: those of the joint, or for all joints those of the first joint that flexes."""
        actor = self._room.state.actor
        if actor is None:
            return
        names = (_ALL, *actor.skeleton.names)
        if tuple(self.joint.options) != names:
            self.joint.options = names
        if self.joint.value == _ALL:
            joint = int((actor.skeleton.limits[:, 0, 1] > 0).argmax())
        else:
            joint = actor.skeleton.names.index(self.joint.value)
        for name, slider in self.sliders.items():
            self._show(slider, name, float(getattr(actor.parameters, name)[joint]))
        for slider, value in zip(self.near, actor.parameters.proximity[joint], strict=True):
            self._show(slider, "proximity", float(value))

    def _show(self, slider: Any, name: str, value: float) -> None:
        if abs(slider.value - value) > 0.006 and not self._room.worker.waits(("parameter", name)):
            slider.value = min(max(value, slider.min), slider.max)

    def _slider(self, name: str, low: float, high: float) -> Any:
        slider = self._room.server.gui.add_slider(name.capitalize(), min=low, max=high, step=0.01, initial_value=low)
        slider.on_update(
            lambda event: self._room.by_hand(
                event, lambda: self._set(name, number(slider.value)), key=("parameter", name)
            )
        )
        return slider

    def _near(self, label: str) -> Any:
        slider = self._room.server.gui.add_slider(label, min=0.0, max=_HALF, step=0.01, initial_value=0.3)

        def change() -> None:
            self._set("proximity", " ".join(number(one.value) for one in self.near))

        slider.on_update(lambda event: self._room.by_hand(event, change, key=("parameter", "proximity")))
        return slider

    def _set(self, name: str, values: str) -> None:
        """Write a parameter of the chosen joint into the script."""
        state = self._room.state
        if state.actor is None:
            return
        what = f"PARAMETER {self.joint.value} {name.upper()}"
        other = None if state.scene.current == state.actor.name else state.actor.name
        text = with_values(state.document.text, {what: values}, actor=other)
        state.put(text, kind=("parameter", name, self.joint.value))
