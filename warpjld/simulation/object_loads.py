"""Forces that are asked for on objects over keys: on points, on faces, of turning (B eqs. 1–4, R97)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from warpjld.simulation.state_variables import Points

if TYPE_CHECKING:
    from warpjld.motion import Track

__all__ = ["ObjectLoad", "ObjectSpin"]


@dataclass(eq=False)
class ObjectLoad:
    """A load on points of an object, or on the faces of its outside between them.

    Attributes:
        kind: ``force``, in all on these points [N]; ``traction``, on these faces, of constant direction, or
            ``pressure``, against them as they turn, per area at rest and as it is [Pa].
        points: Which.
        tracks: Keys of ``x``, ``y``, ``z``; of ``pressure`` alone.
    """

    kind: Literal["force", "traction", "pressure"]
    points: Points
    tracks: dict[str, Track] = field(default_factory=dict)

    def at(self, channel: str, frame: float) -> float:
        """Its value at a frame; nothing before its first key."""
        track = self.tracks.get(channel)
        return 0.0 if track is None or frame < track.keys[0].frame else float(track.spline(frame))


@dataclass(eq=False)
class ObjectSpin:
    """An object that turns steadily as seen from outside, and bears the centrifugal force while it stands here.

    Attributes:
        axis: Its direction, of any length but zero.
        point: A point on it, on the stage [m].
        track: Keys of its speed [rad/s].
    """

    axis: tuple[float, float, float]
    point: tuple[float, float, float]
    track: Track

    def at(self, frame: float) -> float:
        """Speed at a frame [rad/s]; nothing before its first key."""
        return 0.0 if frame < self.track.keys[0].frame else float(self.track.spline(frame))
