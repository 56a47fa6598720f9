"""What a script prescribes of objects over keys: displacements of their points, and formulas (R94, R128)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

if TYPE_CHECKING:
    from warpjld.motion import Track

__all__ = ["BarrKeys", "Points", "PrescribedPoints"]


@dataclass(frozen=True)
class Points:
    """Points of a deformable object (R128).

    Attributes:
        kind: ``all``, the ``upper`` or ``lower`` end along an axis, or those ``near`` a place.
        axis: 0, 1 or 2, of the object's own frame.
        share: Of its extent along the axis.
        centre: Of a ball on the stage, where the object is at first [m].
        radius: Its radius [m].
    """

    kind: Literal["all", "upper", "lower", "near"] = "all"
    axis: int = 0
    share: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0

    def choose(self, local: NDArray[np.float64], stage: NDArray[np.float64]) -> NDArray[np.int64]:
        """Numbers of the points that are meant, of positions in the object's frame and on the stage (n, 3) [m].

        Raises:
            InputError: None is.
        """
        if self.kind == "all":
            return np.arange(len(local))
        if self.kind == "near":
            chosen = np.linalg.norm(stage - np.array(self.centre), axis=1) <= self.radius
        else:
            x = local[:, self.axis]
            low, high = float(x.min()), float(x.max())
            reach = (self.share + 1e-9) * (high - low)
            chosen = x >= high - reach if self.kind == "upper" else x <= low + reach
        if not chosen.any():
            raise InputError("no point of the object lies there")
        return np.flatnonzero(chosen)


@dataclass(eq=False)
class PrescribedPoints:
    """A state variable: displacements of object points from where they are at first, over keys (R128).

    Attributes:
        points: Which.
        tracks: Keys of the prescribed axes ``x``, ``y``, ``z`` [m]: three of them (VECTOR) or fewer.
        held: Whether the points go where the object's place goes; ``tracks`` then displace them from there.
        until: Frame after which points that are held are free.
    """

    points: Points
    tracks: dict[str, Track] = field(default_factory=dict)
    held: bool = False
    until: float = float("inf")

    def holds(self, frame: float) -> bool:
        """Whether the points go with the object at a frame."""
        return self.held and frame <= self.until


@dataclass(eq=False)
class BarrKeys:
    """Barr's deformations of an object, over keys (R94).

    Attributes:
        axis: ``x``, ``y`` or ``z``.
        tracks: Keys of ``taper`` (share), ``twist`` and ``bend`` [rad].
    """

    axis: Literal["x", "y", "z"]
    tracks: dict[str, Track] = field(default_factory=dict)

    def at(self, kind: str, frame: float) -> float:
        """The amount at a frame."""
        track = self.tracks.get(kind)
        return 0.0 if track is None else float(track.spline(frame))
