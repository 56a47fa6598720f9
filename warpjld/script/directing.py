"""Key-framed cameras and lamps, and the shot of a frame (R135)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from warpjld.motion import Key, Track
from warpjld.render.lights import Lamp

if TYPE_CHECKING:
    from warpjld.script.outputs import CameraSetting, Shot

__all__ = ["KeyedLamp", "camera_at", "shot_at"]


def camera_at(camera: CameraSetting, frame: float) -> CameraSetting:
    """A camera setting at a frame, interpolated between its keys by splines; unchanged without keys."""
    if not camera.keys:
        return camera

    def on(values: Sequence[float]) -> float:
        track = Track("camera")
        for key, value in zip(camera.keys, values, strict=True):
            track.set(Key(key.frame, value, *key.spline))
        return float(track.spline(frame))

    def place(points: Sequence[tuple[float, float, float]]) -> tuple[float, float, float]:
        x, y, z = (on([point[axis] for point in points]) for axis in range(3))
        return x, y, z

    return replace(
        camera,
        position=place([key.position for key in camera.keys]),
        target=place([key.target for key in camera.keys]),
        zoom=max(0.01, on([key.zoom for key in camera.keys])),
        roll=on([key.roll for key in camera.keys]),
        keys=(),
    )


def shot_at(shots: Sequence[Shot], frame: float) -> Shot | None:
    """The shot that a frame belongs to, or None."""
    return next((shot for shot in shots if shot.first <= frame <= shot.last), None)


@dataclass(eq=False)
class KeyedLamp:
    """A lamp with key-framed position, target and intensity.

    Attributes:
        color: ``#rrggbb``.
        parallel: Whether it is directional (parallel rays) rather than a point light.
        tracks: Keys of its position ``px py pz`` [m], its target ``tx ty tz`` [m] and its ``intensity``.
    """

    color: str
    parallel: bool
    tracks: dict[str, Track] = field(default_factory=dict)

    def set(self, frame: float, values: dict[str, float], spline: tuple[float, float, float]) -> None:
        """Set keys at a frame."""
        for channel, value in values.items():
            self.tracks.setdefault(channel, Track(channel)).set(Key(frame, value, *spline))

    def at(self, frame: float) -> Lamp:
        """The lamp at a frame."""
        px, py, pz, tx, ty, tz, intensity = (
            float(self.tracks[channel].spline(frame)) for channel in ("px", "py", "pz", "tx", "ty", "tz", "intensity")
        )
        return Lamp((px, py, pz), (tx, ty, tz), self.color, max(0.0, intensity), self.parallel)
