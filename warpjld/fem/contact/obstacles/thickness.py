"""Thickness of obstacles and relative motion of points along them, for limits on load steps."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.obstacles.obstacle import Obstacle

__all__ = ["distance_past", "half_thickness", "relative_paths"]

_POINTS = 200
"""Sample points on an obstacle's surface."""
_THIN = 5.0
"""Percentile of the sampled half thicknesses that is returned."""
_FINEST, _GROWS = 2.5e-4, 1.6
"""First depth at which thickness is sampled [m], and ratio of successive depths, up to the obstacle's size."""
_KNOWN: WeakKeyDictionary[Obstacle, float] = WeakKeyDictionary()
"""Cache of half thicknesses."""


def half_thickness(obstacle: Obstacle, time: float = 0.0) -> float:
    """Depth up to which a point in an obstacle is closest to the side through which it entered [m]."""
    if obstacle in _KNOWN:
        return _KNOWN[obstacle]
    vertices, faces = obstacle.mesh(time)
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    share = np.cumsum(area) / max(float(area.sum()), 1e-300)
    sampled = np.minimum(np.searchsorted(share, (np.arange(_POINTS) + 0.5) / _POINTS), len(area) - 1)  # evenly by area
    points, normal = corners[sampled].mean(axis=1), normal[sampled] / np.maximum(area[sampled], 1e-300)[:, None]
    depth, deepest = _FINEST, np.full(len(points), _FINEST)
    size = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0)))
    while depth <= size:
        deepest = np.maximum(deepest, -obstacle.project(points - depth * normal, time).distance)
        depth *= _GROWS
    _KNOWN[obstacle] = float(np.percentile(deepest, _THIN))
    return _KNOWN[obstacle]


def relative_paths(obstacle: Obstacle, times: Sequence[float], path: Sequence[Array]) -> Array:
    """Lengths of the paths of points (n, 3) at ascending times relative to an obstacle [m], shape (n,)."""
    out = np.zeros(len(path[0]))
    for before, time, x, there in zip(times[:-1], times[1:], path[:-1], path[1:], strict=True):
        out += np.linalg.norm(obstacle.carried(there, time, before) - x, axis=1)
    return out


def distance_past(obstacle: Obstacle, times: Sequence[float], path: Sequence[Array]) -> float:
    """Longest relative path of points (n, 3) at ascending times [m], among those that may reach the obstacle on it."""
    lengths = relative_paths(obstacle, times, path)
    near = obstacle.project(path[0], times[0]).distance < lengths
    return float(lengths[near].max(initial=0.0))
