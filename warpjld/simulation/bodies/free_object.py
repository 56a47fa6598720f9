"""Where a free object goes when hands close on it: a first guess for the contact solver.

Nothing but contact holds such an object, and an equilibrium that lies millimetres away is far for Newton's method. As a
rigid body that overlaps everything softly it finds its way in a moment.
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
_STILL = 1e-7
"""Steps shorter than this share of the object's size end the search."""

_RELUCTANCE = 1e-3
"""Stiffness that keeps the object where it is, over that of what touches it."""

_HARD = 10.0
"""Weight of obstacles over flesh."""


@dataclass(frozen=True, eq=False)
class RigidMove:
    """A rigid motion x → R (x − centre) + centre + shift.

    Attributes:
        turn: R.
        centre: [m], shape (3,).
        shift: [m], shape (3,).
        overlap: How deep the deepest point is still inside [m], 0 where the object is free.
    """

    turn: Rotation
    centre: NDArray[np.float64]
    shift: NDArray[np.float64]
    overlap: float

    def of(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where points (n, 3) [m] of the object go."""
        return np.asarray(self.turn.apply(points - self.centre) + self.centre + self.shift)


def settle_free_object(
    nodes: NDArray[np.float64],
    surface: NDArray[np.int32],
    others: NDArray[np.float64],
    obstacles: Sequence[Obstacle],
    time: float,
) -> RigidMove:
    """Move an object as one to where it overlaps others least, evenly on all sides.

    Minimises Σ ½ w d² over all points with a negative distance d, by the Gauss–Newton method in six motions.

    Args:
        nodes: Of the object [m], shape (N, 3).
        surface: Triangles of its outside, shape (T, 3).
        others: Points of what touches it [m], shape (M, 3).
        obstacles: What does not give way.
        time: Theirs.
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
