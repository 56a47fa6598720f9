"""Pieces that go round a limb like a ring (bracelets, watches, collars), which stay rigid however wide they are.

A sleeve goes round a limb as well, and bends with it. What sets a band apart is that it is no longer than the limb is
thick, so that no joint lies within it; its width does not matter.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["bands"]

_LONG = 1.0
"""Longest extent of a band along its axis, in units of the host's thickness (its radius)."""
_RADIAL = 0.5
"""Least part of a normal of the skin beneath that is perpendicular to the axis, for it to be of the limb's side."""
_OPEN = np.radians(150.0)
"""Widest gap between the directions of these normals: a bangle may be open, a badge on a chest has all to one side."""


def bands(
    points: NDArray[np.float64], of: NDArray[np.int32], beneath: NDArray[np.float64], thickness: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which shells are bands round their hosts, shape (N,).

    The axis of a shell is the direction of its least extent.

    Args:
        points: Vertices of the shells that lie on hosts [m], shape (n, 3).
        of: Shell of each, shape (n,).
        beneath: Unit normals of the hosts at the nearest places, shape (n, 3).
        thickness: Mean distance of those places from the segments [m], by shell, shape (N,).
    """
    out = np.zeros(len(thickness), dtype=bool)
    order = np.argsort(of, kind="stable")
    numbers, starts = np.unique(of[order], return_index=True)
    for number, mine in zip(numbers, np.split(order, starts[1:]), strict=True):
        away = points[mine] - points[mine].mean(axis=0)
        directions = np.linalg.eigh(away.T @ away)[1]  # the first with the least extent
        if np.ptp(away @ directions[:, 0]) <= _LONG * thickness[number]:
            across = beneath[mine] @ directions[:, 1:]
            across = across[np.linalg.norm(across, axis=1) > _RADIAL]
            angle = np.sort(np.arctan2(across[:, 1], across[:, 0]))
            gaps = np.diff(angle, append=angle[:1] + 2.0 * np.pi)
            out[number] = len(gaps) > 0 and gaps.max() <= _OPEN
    return out
