"""Stance of a digitised body: up, left and forward directions, found from its two legs and feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from warpjld.errors import InputError
from warpjld.geometry.rotations import unit
from warpjld.skeleton.place.solid import VoxelSolid

__all__ = ["Stance", "find_stance", "pieces"]

Array = NDArray[np.float64]

_UPS = ((1, 1.0), (2, 1.0), (0, 1.0), (1, -1.0), (2, -1.0), (0, -1.0))
"""Candidates for the up axis: (axis, sign), the usual ones first."""
_LEGS = (0.12, 0.2, 0.28, 0.36)  # heights, as shares of the whole, at which two legs are expected
_LEG_RATIO = 1.6  # largest ratio of the two legs' section areas
_TALL = 0.6  # least height of all there is, per its largest extent: arms span about the height
_HIPS = 0.5  # height of the hips
_HIPS_LEAST = 0.3  # least distance of the hips, per distance of the thighs, for their direction to be known
_MIDLINE = 0.04  # half the width of what counts as the middle, in heights of all there is
_LOWEST_CROWN = 0.6  # least height of the crown, as a share of the height of all there is
_TRUNK = (0.56, 0.64)  # heights at which one trunk is expected


@dataclass(frozen=True)
class Stance:
    """Frame of an upright body.

    Attributes:
        frame: Rows left, up and forward, shape (3, 3).
        origin: On the floor between the feet, below the trunk, shape (3,).
        height: From the floor to the crown.
    """

    frame: Array
    origin: Array
    height: float

    def inward(self, points: Array) -> Array:
        """Points in the body's frame, per height of the body: x left, y up, z forward."""
        return (points - self.origin) @ self.frame.T / self.height

    def outward(self, points: Array) -> Array:
        """Points back from the body's frame."""
        return points * self.height @ self.frame + self.origin


def pieces(solid: VoxelSolid, chosen: NDArray[np.bool_]) -> list[NDArray[np.int64]]:
    """Connected components of the chosen voxels, the largest first."""
    numbers = np.flatnonzero(chosen)
    _, label = connected_components(solid.part(chosen).graph, directed=False)
    found = [numbers[label == k] for k in range(label.max(initial=-1) + 1)]
    return sorted(found, key=len, reverse=True)


def find_stance(solid: VoxelSolid, label: str) -> Stance:
    """The stance along the first candidate up axis with two legs under one trunk.

    Raises:
        InputError: No axis has them.
    """
    for axis, sign in _UPS:
        up = np.zeros(3)
        up[axis] = sign
        found = _stance_along(solid, up)
        if found is not None:
            return found
    raise InputError(f"{label}: no upright body with two legs apart from one another")


def _pairs(solid: VoxelSolid, share: Array, heights: Sequence[float], slab: float) -> list[list[Array]]:
    """Centres of the sections of two legs at some heights; empty if there are not two alike at each of them."""
    out = []
    for at in heights:
        found = [p for p in pieces(solid, np.abs(share - at) < slab) if len(p) > 20]
        if len(found) < 2 or len(found[0]) > _LEG_RATIO * len(found[1]):
            return []
        if len(found) > 2 and len(found[2]) > 0.5 * len(found[1]):
            return []
        out.append([solid.points[p].mean(axis=0) for p in found[:2]])
    return out


def _apart(legs: Sequence[Sequence[Array]], up: Array) -> Array:
    """Mean horizontal vector from one leg to the other."""
    apart = np.array([a - b if (a - b) @ (legs[0][0] - legs[0][1]) > 0 else b - a for a, b in legs]).mean(axis=0)
    return np.asarray(apart - up * (up @ apart))


def _hips_apart(legs: Sequence[Sequence[Array]], up: Array) -> Array:
    """Horizontal vector from hip to hip: that between the thighs, extrapolated, so that a stride does not turn it."""
    lower, upper = (_apart([legs[0], legs[k]], up) * 2.0 - _apart([legs[0]], up) for k in (-2, -1))
    share = (_HIPS - _LEGS[-1]) / (_LEGS[-1] - _LEGS[-2])
    hips = upper + share * (upper - lower)
    return hips if hips @ upper > _HIPS_LEAST * float(upper @ upper) else _apart(legs, up)


def _toes_ahead(points: Array, share: Array, ankles: Sequence[Array], forward: Array) -> float:
    """How much farther feet reach ahead of their ankles than behind them, both feet together."""
    low = np.flatnonzero(share < _LEGS[0])
    own = np.argmin([np.linalg.norm(points[low] - ankle, axis=1) for ankle in ankles], axis=0)
    out = 0.0
    for k in range(len(ankles)):
        one = low[own == k]
        if not len(one):
            continue
        above, ahead = share[one] - share[one].min(), points[one] @ forward  # a foot of a stride may be in the air
        foot, ankle = ahead[above < 0.03], ahead[(above > 0.05) & (above < 0.1)]
        if len(ankle):
            out += float(foot.max() + foot.min() - 2.0 * np.median(ankle))
    return out


def _stance_along(solid: VoxelSolid, up: Array) -> Stance | None:
    high = solid.points @ up
    low, height = float(high.min()), float(np.ptp(high))
    if height < _TALL * float(np.ptp(solid.points, axis=0).max()):
        return None
    shins = _pairs(solid, (high - low) / height, _LEGS[:2], 1.2 * solid.size / height)
    if not shins:
        return None
    # raised hands may be higher than the head: the crown is the highest place above the middle between the legs
    middle = np.mean([np.mean(pair, axis=0) for pair in shins], axis=0)
    beside = np.abs((solid.points - middle) @ unit(_apart(shins, up)))
    height = float(high[beside < _MIDLINE * height].max(initial=low)) - low
    if height < _LOWEST_CROWN * float(np.ptp(high)):
        return None
    share = (high - low) / height
    slab = 1.2 * solid.size / height
    legs = _pairs(solid, share, _LEGS, slab)
    if not legs:
        return None
    trunk = []
    for at in _TRUNK:
        found = pieces(solid, np.abs(share - at) < slab)
        if not found:
            return None
        trunk.append(solid.points[found[0]].mean(axis=0))
    apart = _apart(legs, up)
    left = unit(_hips_apart(legs, up))
    middle = np.mean([np.mean(pair, axis=0) for pair in legs], axis=0)
    centre = np.mean(trunk, axis=0)
    if abs(float((centre - middle) @ left)) > 0.35 * float(apart @ left):  # the trunk stands between the legs
        return None
    forward = np.cross(left, up)
    if _toes_ahead(solid.points, share, legs[0], forward) < 0.0:
        left, forward = -left, -forward
    origin = centre + up * (low - float(centre @ up))
    return Stance(np.stack([left, up, forward]), origin, height)
