"""Sub-stepping so that no surface tunnels through another.

Contact search reaches about two element edges to both sides, and a point inside an obstacle is taken to have entered
through the nearest side. A step with a larger relative motion could begin in front of a body and end behind it without
any contact force.
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
"""Intervals of a step at which the predicted motion is sampled."""
_MOST = 40
"""Most sub-steps of a step."""


class Substeps:
    """Divides steps by the relative motion of surfaces.

    Args:
        model: The contact model; its motion does not matter.
    """

    def __init__(self, model: ContactModel) -> None:
        mesh = model.body.mesh
        self._surfaces = {one.name: surface_of(mesh, one.faces, one.name) for one in model.bodies}

    def times(self, model: ContactModel, before: float, time: float, displacement: NDArray[np.float64]) -> list[float]:
        """Ascending times ending with ``time``, for a step that starts at ``before`` with a displacement (N, 3) [m]."""
        count = min(_MOST, max(1, int(np.ceil(self.over(model, before, time, displacement) - 1e-9))))
        return [before + (time - before) * (k + 1) / count for k in range(count - 1)] + [time]

    def over(self, model: ContactModel, before: float, time: float, displacement: NDArray[np.float64]) -> float:
        """Largest relative motion of surfaces in a step, over the largest that contact search can follow."""
        times = [before + (time - before) * k / _LOOKS for k in range(_LOOKS + 1)]
        paths = {}
        for one in model.bodies:
            span = model.spans[one.name]
            paths[one.name] = one.path(times, displacement[span], self._surfaces[one.name].nodes - span.start)
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
    """Largest motion of a digit's skin relative to that of another digit it may touch [m], for skin nodes (n,)."""
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
    """Largest motion of points along one path relative to the nearest point of another that they may touch [m]."""
    from scipy.spatial import cKDTree

    away, near = cKDTree(other[0]).query(path[0])
    way = _relative(path, np.arange(len(path[0])), other, near)
    return float(way[away < way + 0.5 * reach].max(initial=0.0))


def _relative(
    path: list[NDArray[np.float64]], mine: NDArray[np.integer], other: list[NDArray[np.float64]], near: NDArray
) -> NDArray[np.float64]:
    """Length of the relative path between points ``mine`` and ``near`` [m], shape (n,)."""
    steps = zip(path[:-1], path[1:], other[:-1], other[1:], strict=True)
    ways = [np.linalg.norm((b - a)[mine] - (d - c)[near], axis=1) for a, b, c, d in steps]
    return np.asarray(np.sum(ways, axis=0), np.float64)
