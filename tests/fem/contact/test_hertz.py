"""Hertz: a sphere on a rigid plane, on a block that is graded towards the pole and whose far sides move as a half-space
under Hertz's force does (Boussinesq), so that a small block will do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.fem.contact.bodies import lid, named, together
from warpjld.fem import Body, HexMesh, LinearElastic, Prescribed, box_hexes, prescribe
from warpjld.fem.contact import ContactInstant, Pair, PairContact, press
from warpjld.fem.contact.interface.contact_area import beyond, held_beyond

YOUNG, POISSON = 1.0, 0.3
MODULUS = YOUNG / (1.0 - POISSON**2)
SIZE = 0.5
APPROACH = 0.0025
TOLERANCE = 0.02


def graded(n: int, grading: float = 4.0) -> HexMesh:
    """A quarter of the sphere's neighbourhood, of radius 1, its pole at the origin; faces grow away from it."""
    mesh = box_hexes(counts=(n, n, n))
    x, y, depth = (SIZE * np.sinh(grading * s) / np.sinh(grading) for s in (*mesh.nodes.T[:2], 1.0 - mesh.nodes[:, 2]))
    sphere = 1.0 - np.sqrt(1.0 - x**2 - y**2)
    return replace(mesh, nodes=np.stack([x, y, -depth - (1.0 - depth / SIZE) * sphere], axis=1))


def half_space(at: NDArray[np.float64], force: float) -> NDArray[np.float64]:
    """Displacement of a half-space z < 0 under a force down at the origin (Johnson 1985, eq. 3.18)."""
    depth = -at[:, 2]
    far = np.linalg.norm(at, axis=1)
    scale = force / (4.0 * np.pi * YOUNG / (2.0 * (1.0 + POISSON)))
    down = scale * (2.0 * (1.0 - POISSON) / far + depth**2 / far**3)
    out = scale * (depth / far**3 - (1.0 - 2.0 * POISSON) / (far * (far + depth)))
    return np.stack([at[:, 0] * out, at[:, 1] * out, -down], axis=1)


def hertz_force(approach: float) -> float:
    return 4.0 / 3.0 * MODULUS * approach**1.5


@cache
def pressed() -> tuple[ContactInstant, ...]:
    """Approaches of 0.0005 to 0.0025 radii."""
    mesh = graded(16)
    held = prescribe(mesh, "x-", x=0.0) + prescribe(mesh, "y-", y=0.0)
    far = np.unique(np.concatenate([mesh.node_set(name) for name in ("x+", "y+", "z-")]))

    def known(time: float) -> Prescribed:
        return held + prescribe(mesh, far, displacement=half_space(mesh.nodes[far], hertz_force(APPROACH * time)))

    pair = Pair("z+", lid(APPROACH, height=0.0))
    return press(Body(mesh, LinearElastic(YOUNG, POISSON)), known, [pair], times=np.arange(1, 6) / 5).instants


@pytest.mark.parametrize("step", range(5))
def test_force_radius_and_pressure(step: int) -> None:
    """Ten faces over the contact's radius at the end, five at the beginning. The peak pressure of a sphere exceeds
    Hertz's, which is a paraboloid's on a half-space, by a share of the order of a / R: 0.3 % first, 1.9 % last."""
    instant = pressed()[step]
    approach = APPROACH * instant.time
    touch = instant.touches[0]
    force, radius = 4.0 * touch.normal_force, np.sqrt(4.0 * touch.contact_area / np.pi)
    assert force == pytest.approx(hertz_force(approach), rel=TOLERANCE)
    assert radius == pytest.approx(np.sqrt(approach), rel=TOLERANCE)
    assert touch.peak == pytest.approx(2.0 / np.pi * MODULUS * np.sqrt(approach), rel=TOLERANCE)


def test_pressure_is_an_ellipsoid() -> None:
    touch = pressed()[-1].touches[0]
    radius = np.linalg.norm(touch.position[:, :2], axis=1) / np.sqrt(APPROACH)
    inside = radius < 0.6
    expected = 2.0 / np.pi * MODULUS * np.sqrt(APPROACH) * np.sqrt(1.0 - radius[inside] ** 2)
    np.testing.assert_allclose(touch.pressure[inside], expected, rtol=0, atol=0.03 * expected.max())


def test_the_border_is_found_from_either_side() -> None:
    """From pressures and gaps of the law itself, averaged by hat functions, wherever the border lies."""
    edge, modulus, slope = 0.1, 2.0, 3.0
    s = np.linspace(-1.0, 1.0, 20001)
    for f in (-0.8, -0.3, 0.0, 0.2, 0.7, 0.95):
        inside = slope * np.sqrt(edge * np.maximum(f - s, 0.0))  # of a border f edges ahead
        pressure = np.trapezoid(inside * (1.0 - np.abs(s)), s)
        gap = 4.0 * slope / (3.0 * modulus) * (edge * (1.0 - f)) ** 1.5
        found = beyond(*(np.array([v]) for v in (pressure, gap, edge, modulus)))
        assert found[0] == pytest.approx(f, abs=1e-3)
        outside = slope * (edge * np.maximum(1.0 - f + s, 0.0)) ** 1.5  # around the open end
        outside = np.interp(s, s[::10000], outside[::10000])  # as a mesh has it
        gap = 4.0 / (3.0 * modulus) * np.trapezoid(outside * (1.0 - np.abs(s)), s)
        found = beyond(*(np.array([v]) for v in (pressure, gap, edge, modulus)), averaged=True)
        assert found[0] == pytest.approx(f, abs=1e-3)
    nothing = beyond(*(np.array([v]) for v in (1.0, np.inf, edge, modulus)))
    assert nothing[0] == pytest.approx(-1.0, abs=1e-6)


def test_the_border_of_what_sticks_is_found_from_inside() -> None:
    """From what is left of Coulomb's limit at two nodes, averaged by hat functions."""
    s = np.linspace(-1.0, 1.0, 20001)
    for f in (-0.8, -0.3, 0.0, 0.4, 0.9):
        rim, inner = (np.trapezoid(np.sqrt(np.maximum(at - s, 0.0)) * (1.0 - np.abs(s)), s) for at in (f, f + 1.0))
        assert held_beyond(np.array([rim]), np.array([inner]))[0] == pytest.approx(f, abs=1e-3)
    assert held_beyond(np.array([1.0]), np.array([0.0]))[0] == 0.0


def spheres() -> Iterator[tuple[float, PairContact]]:
    """Two spheres whose meshes do not match, pressed together by 0.0012 to 0.006 radii: approaches and touches."""
    below, above = graded(14), graded(16)
    above = replace(above, nodes=above.nodes[:, [1, 0, 2]] * [1.0, 1.0, -1.0])  # turned over about x = y
    law = LinearElastic(YOUNG, POISSON)
    body = together({"a": (named(below, "a"), law), "b": (named(above, "b"), law)})
    mesh, whole = body.mesh, 0.006
    held = prescribe(mesh, "a.x-", x=0.0) + prescribe(mesh, "a.y-", y=0.0)
    held += prescribe(mesh, "b.x-", y=0.0) + prescribe(mesh, "b.y-", x=0.0)
    far = [np.unique(np.concatenate([mesh.node_set(f"{k}.{f}") for f in ("x+", "y+", "z-")])) for k in "ab"]

    def known(time: float) -> Prescribed:
        force = MODULUS / 2.0 * 4.0 / 3.0 * np.sqrt(0.5) * (whole * time) ** 1.5
        over = half_space(mesh.nodes[far[1]] * [1.0, 1.0, -1.0], force) * [1.0, 1.0, -1.0]
        lower = prescribe(mesh, far[0], displacement=half_space(mesh.nodes[far[0]], force))
        return held + lower + prescribe(mesh, far[1], displacement=over - [0.0, 0.0, whole * time])

    for instant in press(body, known, [Pair("a.z+", "b.z+")], times=np.arange(1, 6) / 5).instants:
        yield whole * instant.time, instant.touches[0]


@pytest.mark.slow
def test_two_spheres() -> None:
    """E* and R are half of what they are against a plane. Four to eight faces over the radius."""
    for approach, touch in spheres():
        radius = np.sqrt(0.5 * approach)
        assert 4.0 * touch.normal_force == pytest.approx(2.0 / 3.0 * MODULUS * radius * approach, rel=0.02)
        assert np.sqrt(4.0 * touch.contact_area / np.pi) == pytest.approx(radius, rel=0.03)
        assert touch.peak == pytest.approx(2.0 / np.pi * MODULUS * radius, rel=0.03)
