"""Keyed state variables of objects: prescribed displacements of point sets, and Barr deformations (R94, R128)."""

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
    """Rule that selects points of a deformable object (R128).

    Attributes:
        kind: ``all`` points, the ``upper`` or ``lower`` end along an axis, or those ``near`` a position.
        axis: 0, 1 or 2 of the object's own frame, for ``upper`` and ``lower``.
        share: Fraction of the object's extent along the axis that counts as its end.
        centre: Centre of the ball for ``near``, in world coordinates of the initial placement [m].
        radius: Radius of that ball [m].
    """

    kind: Literal["all", "upper", "lower", "near"] = "all"
    axis: int = 0
    share: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0

    def choose(self, local: NDArray[np.float64], stage: NDArray[np.float64]) -> NDArray[np.int64]:
        """Indices of the selected points, given positions in the object's frame and in world coordinates (n, 3) [m].

        Raises:
            InputError: No point is selected.
        """
        if self.kind == "all":
            return np.arange(len(local))
        if self.kind == "near":
            chosen = np.linalg.norm(stage - np.array(self.centre), axis=1) <= self.radius
        else:
            x = local[:, self.axis]
            low, high = float(x.min()), float(x.max())
            reach = (self.share + 1e-9) * (high - low)  # tolerance for rounding, so that share 0 selects the end face
            chosen = x >= high - reach if self.kind == "upper" else x <= low + reach
        if not chosen.any():
            raise InputError("no point of the object lies there")
        return np.flatnonzero(chosen)


@dataclass(eq=False)
class PrescribedPoints:
    """A state variable: keyed displacements of object points from their initial positions (R128).

    Attributes:
        points: Which points.
        tracks: Keys of the prescribed axes ``x``, ``y``, ``z`` [m]: all three (VECTOR) or fewer.
        held: Whether the points follow the object's placement; ``tracks`` then add to it.
        until: Last frame at which held points follow it; afterwards they are free.
    """

    points: Points
    tracks: dict[str, Track] = field(default_factory=dict)
    held: bool = False
    until: float = float("inf")

    def holds(self, frame: float) -> bool:
        """Whether the points follow the object's placement at a frame."""
        return self.held and frame <= self.until


@dataclass(eq=False)
class BarrKeys:
    """Keyed global deformations of an object by Barr (1984) (R94).

    Attributes:
        axis: ``x``, ``y`` or ``z`` of the object.
        tracks: Keys of ``taper`` (fraction), ``twist`` and ``bend`` [rad].
    """

    axis: Literal["x", "y", "z"]
    tracks: dict[str, Track] = field(default_factory=dict)

    def at(self, kind: str, frame: float) -> float:
        """Amount of one kind of deformation at a frame; 0 without keys."""
        track = self.tracks.get(kind)
        return 0.0 if track is None else float(track.spline(frame))
