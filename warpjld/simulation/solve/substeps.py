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
from warpjld.simulation.bodies.model import Bodies
from warpjld.simulation.bodies.flesh_body import HandBody
from warpjld.simulation.bodies.object_body import ObjectBody

__all__ = ["Passing", "half_thickness", "way_past"]

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


def way_past(obstacle: Obstacle, times: list[float], path: list[NDArray[np.float64]]) -> float:
    """Longest way [m] of points (n, 3), at rising times, past an obstacle that they may touch on it."""
    way = np.zeros(len(path[0]))
    for before, time, x, there in zip(times[:-1], times[1:], path[:-1], path[1:], strict=True):
        way += np.linalg.norm(obstacle.carried(there, time, before) - x, axis=1)
    near = obstacle.project(path[0], times[0]).distance < way
    return float(way[near].max(initial=0.0))


class Passing:
    """Cuts steps of bodies so that nothing is stepped over.

    Args:
        bodies: Everything.
    """

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        mesh = bodies.body.mesh
        self._surfaces = {name: surface_of(mesh, faces, name) for name, faces in bodies.surfaces.items()}

    @cached_property
    def _thickness(self) -> Mapping[str, float]:
        return {name: half_thickness(obstacle) for name, obstacle in self._bodies.obstacles.items()}

    def times(self, before: float, time: float, displacement: NDArray[np.float64]) -> list[float]:
        """Rising times, the last of them ``time``, for a step that begins ``before`` at a displacement (N, 3) [m]."""
        count = min(_MOST, max(1, int(np.ceil(self.over(before, time, displacement) - 1e-9))))
        return [before + (time - before) * (k + 1) / count for k in range(count - 1)] + [time]

    def over(self, before: float, time: float, displacement: NDArray[np.float64]) -> float:
        """The farthest way of anything past anything, over what contact can follow in one step."""
        bodies = self._bodies
        times = [before + (time - before) * k / _LOOKS for k in range(_LOOKS + 1)]
        movers: list[HandBody | ObjectBody] = [*bodies.hands, *bodies.objects]
        paths = {one.name: self._path(one, times, displacement) for one in movers}
        worst = 0.0
        for name, path in paths.items():
            reach = self._surfaces[name].reach
            for solid, obstacle in bodies.obstacles.items():
                worst = max(worst, way_past(obstacle, times, path) / min(reach, self._thickness[solid]))
        for hand in bodies.hands:
            reach = self._surfaces[hand.name].reach
            for other in movers:
                if other is hand:
                    way = self._past_itself(hand, paths[hand.name]) if hand.itself else 0.0
                else:
                    way = _past(paths[hand.name], paths[other.name], reach)
                worst = max(worst, way / reach)
        return worst

    def _path(
        self, one: HandBody | ObjectBody, times: list[float], displacement: NDArray[np.float64]
    ) -> list[NDArray[np.float64]]:
        """Where the nodes of a surface are, and are expected to be [m]."""
        span = self._bodies.spans[one.name]
        nodes = self._surfaces[one.name].nodes - span.start
        own = displacement[span]
        if isinstance(one, HandBody):
            rest = one.part.hand.mesh.nodes[nodes]
            return [rest + (own if t == times[0] else one.guess(times[0], t, own))[nodes] for t in times]
        x = one.volume.mesh.nodes[nodes] + own[nodes]
        if not any(one.holds(state, times[-1]) for state, _ in one.states):
            return [x for _ in times]  # what is free goes where it is pushed
        local = one.place(times[0]).to_local(x)[0]
        return [one.place(t).apply(local)[0] for t in times]

    def _past_itself(self, hand: HandBody, path: list[NDArray[np.float64]]) -> float:
        """Longest way of the skin of one digit past that of another it may touch [m]."""
        from scipy.spatial import cKDTree

        flesh = hand.part.hand
        label = flesh.node_labels[self._surfaces[hand.name].nodes - self._bodies.spans[hand.name].start]
        digit = hand.parts.part_of[label]
        worst = 0.0
        for one in np.unique(digit):
            mine, others = np.flatnonzero(digit == one), np.flatnonzero(digit != one)
            if not len(others):
                continue
            away, near = cKDTree(path[0][others]).query(path[0][mine])
            near = others[near]
            way = _relative(path, mine, path, near)
            meets = ~flesh.excluded[label[mine], label[near]] & (away < way)
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
