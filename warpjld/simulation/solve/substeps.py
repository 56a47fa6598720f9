"""How far skin goes past other things in a step, and how many steps that asks for: nothing is to be stepped over.

Contact looks ahead, and behind, by about two edges of elements, and takes a point in an obstacle to have come in by the
nearest side. A step in which skin goes farther may begin before something and end behind it, and no force says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.interface.surface import surface_of
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["Substeps", "distance_past", "half_thickness"]

_LOOKS = 4
"""Moments of a step at which its way is looked at."""
_MOST = 40
"""Steps that one is cut to at most."""
_POINTS = 200
_THIN = 5.0
"""Percentage of an obstacle's surface where it may be thinner than it is said to be."""
_FINEST, _WIDEST, _GROWS = 2.5e-4, 0.02, 1.6
"""Depths at which an obstacle's thickness is looked for [m]: the first, the last, and from one to the next."""


def half_thickness(obstacle: Obstacle, time: float = 0.0) -> float:
    """How deep a point may lie in an obstacle and be nearest to the side it came from [m], at most ``_WIDEST``."""
    vertices, faces = obstacle.mesh(time)
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1)
    share = np.cumsum(size) / max(float(size.sum()), 1e-300)
    some = np.minimum(np.searchsorted(share, (np.arange(_POINTS) + 0.5) / _POINTS), len(size) - 1)  # evenly by area
    points, normal = corners[some].mean(axis=1), normal[some] / np.maximum(size[some], 1e-300)[:, None]
    depth, deepest = _FINEST, np.full(len(points), _FINEST)
    while depth <= _WIDEST:
        deepest = np.maximum(deepest, -obstacle.project(points - depth * normal, time).distance)
        depth *= _GROWS
    return float(np.percentile(deepest, _THIN))


def distance_past(obstacle: Obstacle, times: list[float], path: list[NDArray[np.float64]]) -> float:
    """Longest way [m] of points (n, 3), at rising times, past an obstacle that they may touch on it."""
    way = np.zeros(len(path[0]))
    for before, time, x, there in zip(times[:-1], times[1:], path[:-1], path[1:], strict=True):
        way += np.linalg.norm(obstacle.carried(there, time, before) - x, axis=1)
    near = obstacle.project(path[0], times[0]).distance < way
    return float(way[near].max(initial=0.0))


class Substeps:
    """Cuts steps of bodies so that nothing is stepped over.

    Args:
        model: Everything, however it is driven.
    """

    def __init__(self, model: ContactModel) -> None:
        mesh = model.body.mesh
        self._surfaces = {one.name: surface_of(mesh, one.faces, one.name) for one in model.bodies}
        self._obstacles = model.obstacles

    @cached_property
    def _thickness(self) -> Mapping[str, float]:
        """Of the obstacles, whatever moves them."""
        return {name: half_thickness(obstacle) for name, obstacle in self._obstacles.items()}

    def times(self, model: ContactModel, before: float, time: float, displacement: NDArray[np.float64]) -> list[float]:
        """Rising times, the last of them ``time``, for a step that begins ``before`` at a displacement (N, 3) [m]."""
        count = min(_MOST, max(1, int(np.ceil(self.over(model, before, time, displacement) - 1e-9))))
        return [before + (time - before) * (k + 1) / count for k in range(count - 1)] + [time]

    def over(self, model: ContactModel, before: float, time: float, displacement: NDArray[np.float64]) -> float:
        """The farthest way of anything past anything, over what contact can follow in one step."""
        times = [before + (time - before) * k / _LOOKS for k in range(_LOOKS + 1)]
        paths = {}
        for one in model.bodies:
            span = model.spans[one.name]
            paths[one.name] = one.way(times, displacement[span], self._surfaces[one.name].nodes - span.start)
        worst = 0.0
        for name, path in paths.items():
            reach = self._surfaces[name].reach
            for solid, obstacle in model.obstacles.items():
                worst = max(worst, distance_past(obstacle, times, path) / min(reach, self._thickness[solid]))
        for hand in model.hands:
            reach, path = self._surfaces[hand.name].reach, paths[hand.name]
            ways = [_past(path, other, reach) for name, other in paths.items() if name != hand.name]
            if hand.touches_itself:
                own = self._surfaces[hand.name].nodes - model.spans[hand.name].start
                ways.append(_past_itself(hand, path, own))
            worst = max([worst, *(way / reach for way in ways)])
        return worst


def _past_itself(hand: FleshBody, path: list[NDArray[np.float64]], nodes: NDArray[np.integer]) -> float:
    """Longest way of the skin of one digit, its nodes (n,) on a path, past that of another it may touch [m]."""
    from scipy.spatial import cKDTree

    label = hand.hand.node_labels[nodes]
    digit = hand.parts.part_of[label]
    worst = 0.0
    for one in np.unique(digit):
        mine, others = np.flatnonzero(digit == one), np.flatnonzero(digit != one)
        if not len(others):
            continue
        away, near = cKDTree(path[0][others]).query(path[0][mine])
        near = others[near]
        way = _relative(path, mine, path, near)
        meets = ~hand.hand.excluded[label[mine], label[near]] & (away < way)
        worst = max(worst, float(way[meets].max(initial=0.0)))
    return worst


def _past(path: list[NDArray[np.float64]], other: list[NDArray[np.float64]], reach: float) -> float:
    """Longest way of points along one path past the nearest of another that they may touch on it [m]."""
    from scipy.spatial import cKDTree

    away, near = cKDTree(other[0]).query(path[0])
    way = _relative(path, np.arange(len(path[0])), other, near)
    return float(way[away < way + 0.5 * reach].max(initial=0.0))


def _relative(
    path: list[NDArray[np.float64]], mine: NDArray[np.integer], other: list[NDArray[np.float64]], near: NDArray
) -> NDArray[np.float64]:
    """How far points go past others on their paths [m], shape (n,)."""
    steps = zip(path[:-1], path[1:], other[:-1], other[1:], strict=True)
    ways = [np.linalg.norm((b - a)[mine] - (d - c)[near], axis=1) for a, b, c, d in steps]
    return np.asarray(np.sum(ways, axis=0), np.float64)
