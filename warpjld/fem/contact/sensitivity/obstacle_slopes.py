"""Spatial derivatives of an obstacle's distance, normal and motion, by central differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.obstacles.obstacle import Obstacle

__all__ = ["ObstacleSlopes", "obstacle_slopes"]

_STEP = 1e-4
"""Step of the differences, in element edges: far below the size of facets, far above rounding errors."""


@dataclass(frozen=True, eq=False)
class ObstacleSlopes:
    """Derivatives with respect to the positions of m points.

    Attributes:
        distance: Gradient of the signed distance, shape (m, 3).
        normal: Derivative of the outward normal [1/m], shape (m, 3, 3), last axis by position.
        carried: Derivative of the obstacle's displacement since the start of the step, shape (m, 3, 3), likewise.
    """

    distance: Array
    normal: Array
    carried: Array


def obstacle_slopes(obstacle: Obstacle, points: Array, before: float, time: float, edge: Array) -> ObstacleSlopes:
    """Spatial derivatives of an obstacle at ``time``, for a step that began at ``before``.

    Args:
        obstacle: The obstacle.
        points: Positions [m], shape (m, 3).
        before, time: Start and end of the step.
        edge: Edges of the faces at the points [m], shape (m,).
    """
    count = len(points)
    distance, normal, carried = np.zeros((count, 3)), np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    if count == 0:
        return ObstacleSlopes(distance, normal, carried)
    step = _STEP * edge
    for axis in range(3):
        ends = []
        for sign in (1.0, -1.0):
            there = points.copy()
            there[:, axis] += sign * step
            found = obstacle.project(there, time)
            moved = found.closest - obstacle.carried(found.closest, time, before)
            ends.append((found.distance, found.normal, moved))
        distance[:, axis] = (ends[0][0] - ends[1][0]) / (2.0 * step)
        normal[:, :, axis] = (ends[0][1] - ends[1][1]) / (2.0 * step)[:, None]
        carried[:, :, axis] = (ends[0][2] - ends[1][2]) / (2.0 * step)[:, None]
    return ObstacleSlopes(distance, normal, carried)
