"""Partial slip of a sphere pressed on a plane and then pushed aside (Cattaneo 1938, Mindlin 1949; Johnson 1985, §7.2).

Of the contact's radius a, the part inside c = a (1 − Q / μP)^⅓ sticks; around it friction is μ p. Tractions are
μ p₀ (√(1 − r²/a²) − (c/a) √(1 − r²/c²)). The sphere is nearly incompressible: normal and tangential tractions then do
not know of one another, as the theory takes for granted.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.fem import Body, HexMesh, LinearElastic, Prescribed, box_hexes, prescribe
from warpjld.fem.contact import Pair, PairContact, press
from warpjld.fem.contact.obstacles.solids import Plane

YOUNG, POISSON, FRICTION = 1.0, 0.49, 0.3
SHEAR, MODULUS = YOUNG / (2.0 * (1.0 + POISSON)), YOUNG / (1.0 - POISSON**2)
APPROACH, SIZE = 0.005, 0.5
RADIUS = np.sqrt(APPROACH)
FORCE = 4.0 / 3.0 * MODULUS * APPROACH**1.5
SHARES = (0.25, 0.5, 0.75)
"""Q / μP."""


def graded(n: int, grading: float = 3.0) -> HexMesh:
    """The half y > 0 of the sphere's neighbourhood, its pole at the origin; faces grow away from it."""
    mesh = box_hexes((2.0, 1.0, 1.0), (2 * n, n, n), origin=(-1.0, 0.0, -1.0))
    x, y, z = (SIZE * np.sinh(grading * s) / np.sinh(grading) for s in mesh.nodes.T)
    sphere = 1.0 - np.sqrt(1.0 - np.minimum(x**2 + y**2, 0.9))
    return replace(mesh, nodes=np.stack([x, y, z - (1.0 + z / SIZE) * sphere], axis=1))


def half_space(at: NDArray[np.float64], down: float, aside: float) -> NDArray[np.float64]:
    """Displacement of a half-space z < 0 under a force at the origin (Boussinesq, Cerruti; Johnson, eqs 3.18, 3.75)."""
    x, y, z = at[:, 0], at[:, 1], -at[:, 2]
    far = np.linalg.norm(at, axis=1)
    free = 1.0 - 2.0 * POISSON
    p, q = down / (4.0 * np.pi * SHEAR), aside / (4.0 * np.pi * SHEAR)
    out = z / far**3 - free / (far * (far + z))
    turned = 1.0 / far**3 - free / (far * (far + z) ** 2)
    u = q * (1.0 / far + free / (far + z) + x**2 * turned) + p * x * out
    v = q * x * y * turned + p * y * out
    w = q * (x * z / far**3 + free * x / (far * (far + z))) + p * (2.0 * (1.0 - POISSON) / far + z**2 / far**3)
    return np.stack([u, v, -w], axis=1)


def share_at(time: float) -> float:
    """Pressed down to time 1, pushed aside to times 2, 3, 4."""
    return float(np.interp(time, [1.0, 2.0, 3.0, 4.0], [0.0, *SHARES]))


def aside(time: float) -> float:
    """Mindlin's displacement of the plane [m]."""
    scale = 3.0 * FRICTION * FORCE * (2.0 - POISSON) / (16.0 * SHEAR * RADIUS)
    return scale * (1.0 - (1.0 - share_at(time)) ** (2.0 / 3.0))


@cache
def pushed(n: int = 10, grading: float = 3.0, until: float = 3.0) -> list[PairContact]:
    """Contact at the times of ``share_at`` up to ``until``."""
    mesh = graded(n, grading)
    held = prescribe(mesh, "y-", y=0.0)
    far = np.unique(np.concatenate([mesh.node_set(name) for name in ("x-", "x+", "y+", "z-")]))

    def known(time: float) -> Prescribed:
        down = 4.0 / 3.0 * MODULUS * (APPROACH * min(time, 1.0)) ** 1.5
        move = half_space(mesh.nodes[far], down, share_at(time) * FRICTION * down)
        on_plane = mesh.nodes[far, 1] == 0.0
        move[on_plane, 1] = 0.0
        return held + prescribe(mesh, far, displacement=move)

    plane = Plane(
        (0, 0, 0), (0, 0, -1), motion=lambda t: ((aside(t), 0.0, -APPROACH * min(t, 1.0)), (0.0, 0.0, 0.0, 1.0))
    )
    times = [time for time in (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0) if time <= until]
    pair = Pair("z+", plane, friction=FRICTION)
    found = press(Body(mesh, LinearElastic(YOUNG, POISSON)), known, [pair], times=times)
    return [instant.touches[0] for instant in found.instants if instant.time in (1.0, 2.0, 3.0, 4.0)]


@pytest.mark.parametrize("step", [1, 2, pytest.param(3, marks=pytest.mark.slow)])
def test_stick_radius_and_tractions(step: int) -> None:
    """Faces are a fifth of the contact's radius."""
    start, touch = pushed()[0], (pushed(until=4.0) if step == 3 else pushed())[step]
    limit = FRICTION * touch.normal_force
    share = float(touch.force[0]) / limit
    assert share == pytest.approx(SHARES[step - 1], rel=0.1)
    stuck, whole = (np.sqrt(2.0 * area / np.pi) for area in (touch.held.sum(), touch.contact_area))
    assert whole == pytest.approx(RADIUS, rel=0.02)
    inside = (1.0 - share) ** (1.0 / 3.0)
    assert stuck / whole == pytest.approx(inside, abs=0.07)

    size = np.linalg.norm(touch.traction[:, :2], axis=1)
    assert (size <= FRICTION * touch.pressure * (1.0 + 1e-3) + 1e-9).all()
    at = np.linalg.norm(touch.position[:, :2], axis=1) / RADIUS
    peak = FRICTION * 2.0 / np.pi * MODULUS * RADIUS
    outer, inner = (np.sqrt(np.maximum(1.0 - at**2 / c**2, 0.0)) for c in (1.0, inside))
    expected = peak * (outer - inside * inner)
    before = np.zeros(len(at))  # pressing alone leaves a little friction, as ν is not quite ½
    common, mine, its = np.intersect1d(touch.nodes, start.nodes, return_indices=True)
    assert len(common) > 30
    before[mine] = start.traction[its, 0]
    middle = at < 0.7
    np.testing.assert_allclose((touch.traction[:, 0] - before)[middle], expected[middle], rtol=0, atol=0.1 * peak)


def test_pressing_alone_sticks_everywhere() -> None:
    touch = pushed()[0]
    assert touch.sliding == 0.0
    assert abs(touch.force[0]) < 1e-4 * touch.normal_force
    assert 2.0 * touch.normal_force == pytest.approx(FORCE, rel=0.03)


@pytest.mark.slow
def test_stick_radius_on_a_finer_mesh() -> None:
    """Thirteen faces over the contact's radius: Mindlin's stick radius, for the force that is there, to 3 %."""
    for touch in pushed(16, 3.8, 4.0)[1:]:
        share = float(touch.force[0]) / (FRICTION * touch.normal_force)
        assert np.sqrt(touch.held.sum() / touch.contact_area) == pytest.approx((1.0 - share) ** (1.0 / 3.0), rel=0.03)
