"""What two sides can hold by friction, and what they squeeze out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.simulation.solve.friction_closure import friction_closure


def wedge(lean: float, turn: float = 0.0) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Two pads, each a patch of points, that press on a ball from both sides and lean by an angle [degrees]."""
    tip, side = np.radians(lean), np.radians(np.linspace(-4.0, 4.0, 5))
    out = []
    for sign in (-1.0, 1.0):
        for a in side:
            out.append([sign * np.cos(tip + a), np.sin(tip + a), 0.0])
            out.append([sign * np.cos(tip), np.sin(tip), np.sin(a)])
    outward = np.array(out) / np.linalg.norm(out, axis=1)[:, None]
    c, s = np.cos(turn), np.sin(turn)
    outward = outward @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]).T
    return 0.03 * outward, -outward, np.full(len(outward), 1e-3)


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize(("lean", "held"), [(0.0, True), (20.0, True), (33.0, True), (40.0, False), (60.0, False)])
def test_wedge_holds_inside_the_cone(lean: float, held: bool, turn: float) -> None:
    """Pads that lean by less than atan μ, 31°, and by the 4° that their edges add, hold; more squeezes the ball out."""
    assert friction_closure(*wedge(lean, turn), friction=0.6) is held


def test_one_side_or_slippery_sides_only_push() -> None:
    points, inward, depth = wedge(0.0)
    one = points[:, 0] > 0.0
    assert not friction_closure(points[one], inward[one], depth[one], 0.6)
    assert not friction_closure(points[:1], inward[:1], depth[:1], 0.6)
    assert not friction_closure(*wedge(10.0), friction=0.0)
