"""Rigid predictor for a free object on which hands close: the placement with the least overlap.

Only contact holds such an object, and an equilibrium millimetres away is out of reach of Newton's method. Minimising a
penalty of the overlap over rigid motions is cheap and comes near to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.facets import Facets

__all__ = ["RigidMove", "settle_free_object"]

_ROUNDS = 40
"""Most Gauss–Newton iterations."""
_STILL = 1e-7
"""Step below which the iteration has converged, relative to the object's size."""

_RELUCTANCE = 1e-3
"""Regularisation (Levenberg), relative to the total penalty weight."""

_HARD = 10.0
"""Penalty weight of obstacles relative to that of flesh."""


@dataclass(frozen=True, eq=False)
class RigidMove:
    """A rigid motion x → R (x − centre) + centre + shift.

    Attributes:
        turn: Rotation R.
        centre: Fixed point of the rotation [m], shape (3,).
        shift: Translation [m], shape (3,).
        overlap: Remaining depth of the deepest point [m]; 0 without overlap.
    """

    turn: Rotation
    centre: NDArray[np.float64]
    shift: NDArray[np.float64]
    overlap: float

    def of(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points of the object (n, 3) [m] moved."""
        return np.asarray(self.turn.apply(points - self.centre) + self.centre + self.shift)


def settle_free_object(
    nodes: NDArray[np.float64],
    surface: NDArray[np.int32],
    others: NDArray[np.float64],
    obstacles: Sequence[Obstacle],
    time: float,
) -> RigidMove:
    """Rigid motion of an object that minimises its overlap with flesh and obstacles.

    Minimises Σ ½ w d² over all points with a negative distance d, by the Gauss–Newton method in six degrees of freedom.

    Args:
        nodes: Nodes of the object [m], shape (N, 3).
        surface: Triangles of its outer surface, shape (T, 3).
        others: Points of the skins around it [m], shape (M, 3).
        obstacles: Rigid obstacles.
        time: Time at which the obstacles are evaluated [frames].
    """
    used = np.unique(surface)
    centre = nodes[used].mean(axis=0)
    reach = float(np.linalg.norm(nodes[used] - centre, axis=1).max())
    near = others[np.linalg.norm(others - centre, axis=1) < 2.0 * reach]
    turn, shift, overlap = Rotation.identity(), np.zeros(3), 0.0
    if not len(near) and not obstacles:
        return RigidMove(turn, centre, shift, overlap)
    shape = Facets(nodes, surface)
    for _ in range(_ROUNDS):
        rows, errors, weights = [], [], []
        if len(near):
            found = shape.project(turn.inv().apply(near - centre - shift) + centre)
            inside = found.distance < 0.0
            normal = turn.apply(found.normal[inside])
            arm = near[inside] - centre - shift
            rows.append(-np.concatenate([normal, np.cross(arm, normal)], axis=1))
            errors.append(found.distance[inside])
            weights.append(np.ones(int(inside.sum())))
        now = turn.apply(nodes[used] - centre) + centre + shift
        for obstacle in obstacles:
            touching = obstacle.project(now, time)
            inside = touching.distance < 0.0
            normal, arm = touching.normal[inside], now[inside] - centre - shift
            rows.append(np.concatenate([normal, np.cross(arm, normal)], axis=1))
            errors.append(touching.distance[inside])
            weights.append(np.full(int(inside.sum()), _HARD))
        jacobian, error, weight = np.concatenate(rows), np.concatenate(errors), np.concatenate(weights)
        overlap = -float(error.min(initial=0.0))
        if not len(error):
            break
        scale = np.array([1.0, 1.0, 1.0, reach, reach, reach])
        pull = jacobian.T @ (weight * error)
        stiff = (jacobian.T * weight) @ jacobian + np.diag(_RELUCTANCE * weight.sum() * scale**2)
        step = -np.linalg.solve(stiff, pull)
        longest = float(np.abs(step * scale).max())
        step *= min(1.0, 0.05 * reach / max(longest, 1e-300))
        shift = shift + step[:3]
        turn = Rotation.from_rotvec(step[3:]) * turn
        if longest < _STILL * reach:
            break
    return RigidMove(turn, centre, shift, overlap)
