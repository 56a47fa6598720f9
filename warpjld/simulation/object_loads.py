"""Keyed external loads on objects: nodal forces, surface tractions and pressures, rotation (B eqs. 1–4, R97)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from warpjld.simulation.state_variables import Points

if TYPE_CHECKING:
    from warpjld.motion import Track
    from warpjld.simulation.object_material import SourceLocation

__all__ = ["ObjectLoad", "ObjectSpin"]


@dataclass(eq=False)
class ObjectLoad:
    """A load on points of an object, or on the faces of its outer surface between them.

    Attributes:
        kind: ``force``: total force on the points [N]; ``traction``: dead load of constant direction per area at rest
            [Pa]; ``pressure``: follower load against the faces, per current area [Pa].
        points: Points it acts on, or whose faces it acts on.
        tracks: Keys of ``x``, ``y``, ``z``, or of ``pressure`` only.
    """

    kind: Literal["force", "traction", "pressure"]
    points: Points
    tracks: dict[str, Track] = field(default_factory=dict)

    def at(self, channel: str, frame: float) -> float:
        """Value of a channel at a frame [N or Pa]; 0 before its first key."""
        track = self.tracks.get(channel)
        return 0.0 if track is None or frame < track.frames[0] else float(track.spline(frame))


@dataclass(eq=False)
class ObjectSpin:
    """Steady rotation of an object, modelled as centrifugal force in the rotating frame.

    Attributes:
        axis: Direction of the axis, of any length but zero.
        point: A point on the axis in world coordinates [m].
        track: Keys of the angular speed [rad/s].
        where: Script location, for messages.
    """

    axis: tuple[float, float, float]
    point: tuple[float, float, float]
    track: Track
    where: SourceLocation | None = None

    def at(self, frame: float) -> float:
        """Angular speed at a frame [rad/s]; 0 before its first key."""
        return 0.0 if frame < self.track.frames[0] else float(self.track.spline(frame))
