"""How far skin goes past other things in a step, and how many steps that asks for: nothing is to be stepped over.

Contact looks ahead, and behind, by about two edges of elements, and takes a point in an obstacle to have come in by the
nearest side. A step in which skin goes farther may begin before something and end behind it, and no force says so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.interface.surface import surface_of
from warpjld.fem.contact.obstacles.thickness import distance_past, half_thickness
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel

__all__ = ["Substeps"]

_LOOKS = 4
"""Moments of a step at which its way is looked at."""
_MOST = 40
"""Steps that one is cut to at most."""


class Substeps:
    """Cuts steps of bodies so that nothing is stepped over.

    Args:
        model: Everything, however it is driven.
    """

    def __init__(self, model: ContactModel) -> None:
        mesh = model.body.mesh
        self._surfaces = {one.name: surface_of(mesh, one.faces, one.name) for one in model.bodies}

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
            for obstacle in model.obstacles.values():
                worst = max(worst, distance_past(obstacle, times, path) / min(reach, half_thickness(obstacle)))
        for name, path in paths.items():
            reach = self._surfaces[name].reach
            ways = [_past(path, other, reach) for another, other in paths.items() if another != name]
            worst = max([worst, *(way / reach for way in ways)])
        for hand in model.hands:
            if hand.touches_itself:
                own = self._surfaces[hand.name].nodes - model.spans[hand.name].start
                worst = max(worst, _past_itself(hand, paths[hand.name], own) / self._surfaces[hand.name].reach)
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
