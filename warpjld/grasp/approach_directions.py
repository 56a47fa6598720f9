"""Directions of approach to a width of the object from which the palm does not collide with the object."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.widths import Widths

__all__ = ["free_ways"]

_ROLLS = 8  # directions tried around each width
_BEHIND = (0.8, 1.0, 1.3, 1.7)  # test points from palm to wrist, as multiples of the distance from pads to palm
_ROOM = 0.15  # clearance at these points (half of the palm's thickness), relative to the same distance


def free_ways(
    near: NearObject, widths: Widths, reach: float, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Directions of approach at right angles to widths, for which the palm would be clear of the object.

    For a bowl's wall these are the directions over the rim, for a flat box those over its edges, for a handle those
    from its side. Tested with the pads at the width; how far the hand then moves on is not considered.

    Args:
        near: The object.
        widths: N widths in world space.
        reach: Distance from the palm's centre to the pads of thumb and fingers [m].
        rng: Source of random numbers.

    Returns:
        Index of the width, shape (n,), and the unit direction in which the hand moves, shape (n, 3).
    """
    line = unit(widths.second - widths.first)
    aside = unit(np.cross(line, np.eye(3)[np.abs(line).argmin(axis=1)]))
    turns = rng.uniform(0.0, 2.0 * np.pi, size=(len(line), 1)) + 2.0 * np.pi * np.arange(_ROLLS) / _ROLLS
    ways = np.cos(turns)[..., None] * aside[:, None] + np.sin(turns)[..., None] * np.cross(line, aside)[:, None]
    middle = 0.5 * (widths.first + widths.second)
    behind = middle[:, None, None] - reach * np.array(_BEHIND)[:, None] * ways[:, :, None]
    local = near.thing.place.to_local(behind.reshape(-1, 3))[0]
    gap = near.near(local, _ROOM * reach).distance.reshape(behind.shape[:3])
    rows, rolls = np.nonzero((gap > _ROOM * reach).all(axis=2))
    return rows, ways[rows, rolls]
