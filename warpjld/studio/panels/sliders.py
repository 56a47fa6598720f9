"""Panel with a slider for every movable channel, grouped by digit; dragging one sets a key at the current frame."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from warpjld.skeleton import DIGITS

if TYPE_CHECKING:
    from warpjld.studio.room import Room

__all__ = ["SlidersPanel", "angle_slider", "show_angle"]

_STEP = 0.5  # step of the sliders [degrees]


class SlidersPanel:
    """Sliders of the selected actor."""

    def __init__(self, room: Room) -> None:
        self._room = room
        self._parent = room.server.gui.add_folder("Joints")
        self._sliders: dict[str, Any] = {}
        self._folders: list[Any] = []
        self._of: object = None

    def refresh(self) -> None:
        """Update the sliders to the angles at the current frame."""
        state = self._room.state
        channels = state.channels()
        if self._of != (made := tuple(channels.items())):
            self._make(channels)
            self._of = made
        for name, degrees in state.angles().items():
            show_angle(self._room, self._sliders[name], name, degrees)

    def _make(self, channels: dict[str, tuple[float, float]]) -> None:
        for folder in self._folders:
            folder.remove()
        self._folders, self._sliders = [], {}
        gui = self._room.server.gui
        with self._parent:
            for part, names in groupby(sorted(channels, key=_order), key=_part):
                folder = gui.add_folder(part, expand_by_default=part.endswith("index"))
                self._folders.append(folder)
                with folder:
                    for name in names:
                        self._sliders[name] = angle_slider(self._room, name, *channels[name])


def angle_slider(room: Room, name: str, low: float, high: float) -> Any:
    """Add a slider for a channel, between limits [degrees], to the current GUI container; its value is not set yet."""
    joint = name.split(".", maxsplit=2)[-1] if name.count(".") > 2 else name
    slider = room.server.gui.add_slider(
        joint.removeprefix("left.").removeprefix("right.").replace(".", " "),
        min=low,
        max=high,
        step=_STEP,
        initial_value=min(max(0.0, low), high),
        hint=f"{name}, from {low:.4g}° to {high:.4g}°",
    )

    def turn() -> None:
        room.state.set_angles({name: slider.value}, kind=("angle", name, room.state.frame))

    slider.on_update(lambda event: room.by_hand(event, turn, key=("angle", name)))
    return slider


def show_angle(room: Room, slider: Any, name: str, degrees: float) -> None:
    """Set a channel's slider, unless it is being dragged."""
    if abs(slider.value - degrees) > 0.5 * _STEP and not room.worker.waits(("angle", name)):
        slider.value = degrees


def _order(channel: str) -> tuple[str, int]:
    """Sorts channels by side, then from the wrist over the thumb to the little finger."""
    side, _, digit = _part(channel).partition(" ")
    return side, DIGITS.index(digit) if digit in DIGITS else -1


def _part(channel: str) -> str:
    """Digit or limb that a channel belongs to."""
    names = channel.split(".")
    return " ".join(names[:2]) if len(names) > 3 else names[0] if names[0] in ("left", "right") else "body"
