"""Allowed net force on a grasped rigid object (R112).

The motion of a rigid object is prescribed, whatever forces act on it. If only a hand holds it, a net contact force has
no counterpart in reality: fingers cannot press harder than thumb and palm press back.
"""

from __future__ import annotations

import numpy as np

from warpjld.fem.contact import Obstacle

__all__ = ["allowed_net", "weight_of"]

_LEFT_OVER = 1.0 / 3.0
"""Net force over the sum of contact forces up to which a grasp counts as balanced (assumed): the error caused by the
object's fixed placement and by rigid joints."""
_WATER, _EARTH = 1000.0, 9.81
"""Assumed density of an object of unknown weight (water) [kg/m³], and gravitational acceleration [m/s²]."""


def allowed_net(pressing: float, weight: float) -> float:
    """Largest allowed net force [N], given the sum of the contact forces [N] and the object's assumed weight [N]."""
    return max(_LEFT_OVER * pressing, weight)


def weight_of(obstacle: Obstacle, time: float = 0.0) -> float:
    """Weight that an obstacle would have if it were made of water [N]."""
    vertices, faces = obstacle.mesh(time)
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    volume = float(np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()) / 6.0
    return _WATER * _EARTH * abs(volume)
