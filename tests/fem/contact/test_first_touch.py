"""Friction in the step of first touch: pressed and dragged in one step, as in twenty."""

from __future__ import annotations

import numpy as np
import pytest

from tests.fem.contact.bodies import named, together
from warpjld.fem import LinearElastic, Loads, SolveStatus, box_hexes, prescribe
from warpjld.fem.contact import Pair, PairContact, press
from warpjld.fem.contact.obstacles.solids import Plane

RUBBER = LinearElastic(1e6, 0.3)
FRICTION = 0.3


def dragged(drag: float, steps: int, *, mesh: bool = False, load: float = 0.0, along: int = 3) -> PairContact:
    """A block .01 m above a floor, brought down by .02 m, or by a load, while its top is dragged along."""
    floor = 0.1 if mesh else 0.0
    parts = {"up": (named(box_hexes((0.1, 0.1, 0.05), (along, along, 2)), "up", (0.1, 0.1, floor + 0.01)), RUBBER)}
    if mesh:
        parts = {"low": (named(box_hexes((0.3, 0.3, 0.1), (5, 5, 2)), "low"), RUBBER), **parts}
    body = together(parts)
    held = prescribe(body.mesh, "up.z+", x=drag, y=0) if load else prescribe(body.mesh, "up.z+", x=drag, y=0, z=-0.02)
    if mesh:
        held = held + prescribe(body.mesh, "low.z-", x=0, y=0, z=0)
    pair = Pair("up.z-", "low.z+" if mesh else Plane((0, 0, 0), (0, 0, 1)), friction=FRICTION)
    loads = Loads(traction={"up.z+": (0, 0, -load / 0.01)}) if load else None
    found = press(body, held, [pair], loads, times=np.arange(1, steps + 1) / steps)
    assert found.status is SolveStatus.CONVERGED
    return found.last.touches[0]


@pytest.mark.parametrize("mesh", [False, True])
def test_one_step_slides_as_many_do(mesh: bool) -> None:
    """Once 90 % less: all of the way counted as gone before the touch."""
    one, many = dragged(0.03, 1, mesh=mesh), dragged(0.03, 8, mesh=mesh)
    np.testing.assert_allclose(one.force, many.force, rtol=2e-3, atol=1e-3 * one.normal_force)
    assert np.linalg.norm(one.force[:2]) == pytest.approx(FRICTION * one.normal_force, rel=0.03)
    assert one.sliding == pytest.approx(1.0)


@pytest.mark.parametrize("mesh", [False, True])
def test_one_step_sticks_as_many_do(mesh: bool) -> None:
    """Dragged by half of what the flesh gives before it slides: the part of the way after the touch counts."""
    one, many = dragged(0.002, 1, mesh=mesh), dragged(0.002, 8, mesh=mesh)
    np.testing.assert_allclose(one.force, many.force, rtol=0.01, atol=2e-3 * one.normal_force)


def test_what_a_load_presses_down_is_dragged_with_friction() -> None:
    touch = dragged(0.05, 1, load=100.0, along=4)
    assert touch.normal_force == pytest.approx(100.0, rel=5e-3)
    assert np.linalg.norm(touch.force[:2]) == pytest.approx(FRICTION * touch.normal_force, rel=0.03)
