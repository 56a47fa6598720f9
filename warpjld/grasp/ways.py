"""From where a hand can come to what it takes between thumb and fingers: where its palm has room."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.widths import Widths

__all__ = ["free_ways"]

_ROLLS = 8  # directions tried about a width
_BEHIND = (0.8, 1.0, 1.3, 1.7)  # where the palm and the wrist will be, as parts of the palm's distance from the pads
_ROOM = 0.15  # half of the palm's thickness, likewise


def free_ways(
    near: NearObject, widths: Widths, reach: float, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Directions at right angles to widths in which a hand can come, so that its palm is clear of the object.

    Of a bowl's wall these are the ways in over the rim, of a flat box those in over its edges, of a handle those from
    the side of it. How far the hand goes on towards the palm from there is left open.

    Args:
        near: The object.
        widths: N of them, on the stage.
        reach: How far the pads of thumb and fingers are from the palm's middle [m].
        rng: Source of randomness.

    Returns:
        Number of the width, shape (n,), and the unit direction in which the hand moves, shape (n, 3).
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
