"""How much of what presses on a grasped object may be left over: no more than it weighs, or friction hides (R112).

A rigid object stays where its animation has it, whatever presses on it. Where a hand alone is to hold it, a net force
is one that nobody applies: fingers cannot press harder than thumb and palm press back.
"""

from __future__ import annotations

import numpy as np

from warpjld.fem.contact import Obstacle

__all__ = ["allowed_net", "weight_of"]

_LEFT_OVER = 1.0 / 3.0
"""Net force over what presses, up to which a grasp is taken to balance: by so much a fixed place of the object, and
joints that do not give, falsify a grip."""
_WATER, _EARTH = 1000.0, 9.81
"""What an object may weigh where nothing is known of it [kg/m³], [m/s²]."""


def allowed_net(pressing: float, weight: float) -> float:
    """Largest net force [N] of a grasp that presses with forces of this sum [N] on what may weigh so much [N]."""
    return max(_LEFT_OVER * pressing, weight)


def weight_of(obstacle: Obstacle, time: float = 0.0) -> float:
    """What an obstacle would weigh if it were of water [N]."""
    vertices, faces = obstacle.mesh(time)
    corners = np.asarray(vertices, dtype=np.float64)[faces]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    volume = float(np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()) / 6.0
    return _WATER * _EARTH * abs(volume)
