"""How thick obstacles are, and how far points go past them: what a load step may not step over."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.obstacles.obstacle import Obstacle

__all__ = ["distance_past", "half_thickness", "way_past"]

_POINTS = 200
_THIN = 5.0
"""Percentage of an obstacle's surface where it may be thinner than it is said to be."""
_FINEST, _GROWS = 2.5e-4, 1.6
"""Depths at which an obstacle's thickness is looked for, up to its size: the first [m], and from one to the next."""
_KNOWN: WeakKeyDictionary[Obstacle, float] = WeakKeyDictionary()


def half_thickness(obstacle: Obstacle, time: float = 0.0) -> float:
    """How deep a point may lie in an obstacle and be nearest to the side it came from [m], at most its size."""
    if obstacle in _KNOWN:
        return _KNOWN[obstacle]
    vertices, faces = obstacle.mesh(time)
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    share = np.cumsum(area) / max(float(area.sum()), 1e-300)
    some = np.minimum(np.searchsorted(share, (np.arange(_POINTS) + 0.5) / _POINTS), len(area) - 1)  # evenly by area
    points, normal = corners[some].mean(axis=1), normal[some] / np.maximum(area[some], 1e-300)[:, None]
    depth, deepest = _FINEST, np.full(len(points), _FINEST)
    size = float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0)))
    while depth <= size:
        deepest = np.maximum(deepest, -obstacle.project(points - depth * normal, time).distance)
        depth *= _GROWS
    _KNOWN[obstacle] = float(np.percentile(deepest, _THIN))
    return _KNOWN[obstacle]


def way_past(obstacle: Obstacle, times: Sequence[float], path: Sequence[Array]) -> Array:
    """Way [m] of points (n, 3), at rising times, past an obstacle, shape (n,)."""
    way = np.zeros(len(path[0]))
    for before, time, x, there in zip(times[:-1], times[1:], path[:-1], path[1:], strict=True):
        way += np.linalg.norm(obstacle.carried(there, time, before) - x, axis=1)
    return way


def distance_past(obstacle: Obstacle, times: Sequence[float], path: Sequence[Array]) -> float:
    """Longest way [m] of points (n, 3), at rising times, past an obstacle that they may touch on it."""
    way = way_past(obstacle, times, path)
    near = obstacle.project(path[0], times[0]).distance < way
    return float(way[near].max(initial=0.0))
