"""Impacts by implicit Euler steps: plane waves in bars, Hertz's ball on a plate, momentum and energy, parted bonds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.fem.contact.bodies import FREE, named, together
from warpjld.errors import InputError
from warpjld.fem import Body, Dynamics, HexMesh, LinearElastic, Loads, NeoHooke, ball_hexes, box_hexes
from warpjld.fem.contact import Bond, ContactInstant, ContactSolution, Pair, press
from warpjld.fem.contact.obstacles.solids import Plane
from warpjld.fem.load.inertia import lumped_masses

YOUNG, DENSITY = 1e6, 1000.0
WAVE = (YOUNG / DENSITY) ** 0.5  # speed of waves in a bar [m/s]
LENGTH, SECTION = 0.1, 4e-4  # of the bar [m, m²]


def falling(body: Body, speed: float) -> Dynamics:
    """All of a body moves down."""
    return Dynamics(np.tile([0.0, -speed, 0.0], (len(body.mesh.nodes), 1)))


def bar(elements: int) -> Body:
    return Body(box_hexes((0.02, LENGTH, 0.02), (1, elements, 1)), LinearElastic(YOUNG, 0.0, DENSITY))


def velocities(instant: ContactInstant) -> np.ndarray:
    """Of the nodes [m/s], shape (N, 3)."""
    assert instant.velocity is not None
    return instant.velocity


def momenta(body: Body, found: ContactSolution) -> np.ndarray:
    """Momentum at each instant [N s], shape (T, 3)."""
    masses = lumped_masses(body)
    return np.array([masses @ velocities(instant) for instant in found.instants])


def forces(found: ContactSolution, pair: int = 0) -> np.ndarray:
    """Contact force on a pair's slave at each instant [N], shape (T, 3)."""
    return np.array([instant.touches[pair].force for instant in found.instants])


@cache
def struck(elements: int, steps: int, speed: float = 1.0) -> tuple[Body, ContactSolution, np.ndarray]:
    """A bar that strikes a wall flat, its motion over 1.25 times 2L/c, and the times over 2L/c."""
    body, times = bar(elements), np.arange(1, steps + 1) * 1.25 / steps
    found = press(
        body,
        FREE,
        [Pair("y-", Plane())],
        times=list(times * 2.0 * LENGTH / WAVE),
        dynamics=falling(body, speed),
        tolerance=1e-7,
    )
    return body, found, times


@pytest.mark.parametrize(
    ("elements", "steps", "within"), [(8, 25, 0.06), pytest.param(60, 200, 0.02, marks=pytest.mark.slow)]
)
def test_a_bar_strikes_a_wall_with_the_pressure_of_a_plane_wave(elements: int, steps: int, within: float) -> None:
    """Pressure ρ c v for the time 2 L/c in which the wave runs to the free end and back (Johnson 1985, §11.1)."""
    body, found, times = struck(elements, steps)
    pressure = forces(found)[:, 1] / SECTION
    plateau = (times > 0.25) & (times < 0.6)
    np.testing.assert_allclose(pressure[plateau], DENSITY * WAVE * 1.0, rtol=within)
    left = times[np.flatnonzero(pressure <= 0.0)[0]]
    assert left == pytest.approx(1.0, abs=0.1 if steps < 100 else 0.03)
    out = momenta(body, found)[-1, 1] / (DENSITY * SECTION * LENGTH)
    assert out == pytest.approx(1.0, abs=0.4 if steps < 100 else 0.15)  # 1 without the losses of the time steps


def test_momentum_and_energy_of_an_impact() -> None:
    """The impulse of contact is the change of momentum, and energy never grows."""
    body, found, times = struck(8, 25)
    mass = DENSITY * SECTION * LENGTH
    step = (times[1] - times[0]) * 2.0 * LENGTH / WAVE
    changes = np.diff(momenta(body, found), axis=0, prepend=[[0.0, -mass, 0.0]])
    np.testing.assert_allclose(changes, step * forces(found), atol=1e-6 * mass)
    masses, energy = lumped_masses(body), [0.5 * mass]
    for instant in found.instants:
        strain = 0.5 * instant.displacement.ravel() @ body.at(instant.displacement).forces
        energy.append(0.5 * masses @ (velocities(instant) ** 2).sum(axis=1) + strain)
    assert np.diff(energy).max() < 1e-9 * energy[0]
    assert energy[-1] > 0.4 * energy[0]  # 25 steps lose a half


def test_a_thrown_body_flies_on_a_parabola_without_strain() -> None:
    body = Body(box_hexes((0.02, 0.02, 0.02), (2, 2, 2)), NeoHooke(YOUNG, 0.4, DENSITY))
    speed = np.tile([1.0, 2.0, 0.0], (len(body.mesh.nodes), 1))
    far, times = Plane((0.0, -1.0, 0.0)), np.arange(1, 9) / 8
    found = press(
        body, FREE, [Pair("y-", far)], Loads(gravity=(0, -9.8, 0)), times=list(times), dynamics=Dynamics(speed, 0.1)
    )
    # the load acts in proportion to time; implicit Euler steps of h = 1/80 s: v = v0 + Σ h g t
    pull = np.cumsum(-9.8 * times) / 80.0
    for instant, down in zip(found.instants, pull, strict=True):
        np.testing.assert_allclose(velocities(instant), [[1.0, 2.0 + down, 0.0]] * 27, atol=1e-9)
    assert np.ptp(found.last.displacement, axis=0).max() < 1e-12


@pytest.mark.parametrize("share", [0.8, 1.5])
def test_a_bond_parts_where_the_wave_is_stronger(share: float) -> None:
    """Halves that fly apart at ±v pull at their bond with ρ c v; it parts when that is more than its strength.

    In the first step the pull is 1.3 times as much, as the velocity jumps between two nodes.
    """
    half = box_hexes((0.02, 0.02, 0.05), (1, 1, 6))
    law = LinearElastic(YOUNG, 0.0, DENSITY)
    body = together({"a": (named(half, "a"), law), "b": (named(half, "b", (0, 0, 0.05)), law)})
    speed = np.tile([0.0, 0.0, -0.5], (len(body.mesh.nodes), 1))
    speed[np.unique(body.mesh.elements[body.mesh.region("b")])] = [0.0, 0.0, 0.5]
    strength = share * DENSITY * WAVE * 0.5
    times = np.arange(1, 16) * LENGTH / WAVE / 20.0
    pair = Pair("a.z+", "b.z-", bond=Bond(normal=strength, shear=strength))
    found = press(body, FREE, [pair], times=list(times), dynamics=Dynamics(speed))
    assert found.last.touches[0].bonded.any() == (share > 1.0)
    pull = forces(found)[:, 2] / SECTION
    assert pull[4:10] == pytest.approx(DENSITY * WAVE * 0.5 if share > 1.0 else 0.0, rel=0.03)


def towards_the_pole(mesh: HexMesh, radius: float, shift: float) -> HexMesh:
    """A ball's mesh made finer at its lowest point, by a Möbius transformation of the ball, which is conformal."""
    centre = np.array([0.0, shift, 0.0])
    x, square = mesh.nodes / radius, shift**2
    away = x - centre
    moved = (1.0 - square) * away - (away**2).sum(axis=1)[:, None] * centre
    return replace(mesh, nodes=radius * moved / (1.0 - 2.0 * x @ centre + square * (x**2).sum(axis=1))[:, None])


@pytest.mark.parametrize(
    ("elements", "steps", "within"), [(4, 24, 0.08), pytest.param(8, 60, 0.04, marks=pytest.mark.slow)]
)
def test_a_ball_strikes_a_plate_as_hertz_has_it(elements: int, steps: int, within: float) -> None:
    """Largest force and duration of an impact of a ball on a rigid plate (Johnson 1985, §11.4).

    At 0.5 % of the speed of waves the duration is that of three passages of a wave to and fro, so that contact is
    nearly quasi-static, as Hertz's theory of impact assumes.
    """
    radius, ratio, speed = 0.02, 0.3, 0.005 * WAVE
    mesh = towards_the_pole(ball_hexes(radius, n=elements), radius, 0.6)
    body = Body(mesh, LinearElastic(YOUNG, ratio, DENSITY))
    modulus, mass = YOUNG / (1.0 - ratio**2), float(lumped_masses(body).sum())
    depth = (15.0 * mass * speed**2 / (16.0 * radius**0.5 * modulus)) ** 0.4
    largest, duration = 4.0 / 3.0 * modulus * radius**0.5 * depth**1.5, 2.94 * depth / speed
    times = np.arange(1, round(1.15 * steps) + 1) * duration / steps
    plate = Plane((0.0, float(mesh.nodes[:, 1].min()), 0.0))
    found = press(body, FREE, [Pair("outer", plate)], times=list(times), dynamics=falling(body, speed))
    force = forces(found)[:, 1]
    assert force.max() == pytest.approx(largest, rel=within)
    assert times[np.flatnonzero(force <= 0.0)[0]] == pytest.approx(duration, rel=within)


def test_wrong_inputs_are_named() -> None:
    body, pairs = bar(2), [Pair("y-", Plane())]
    for wrong, words in (
        (Dynamics(np.zeros((2, 3))), "velocities of shape"),
        (replace(falling(body, 1.0), second=0.0), "unit of time above 0 s"),
    ):
        with pytest.raises(InputError, match=words):
            press(body, FREE, pairs, dynamics=wrong)
    with pytest.raises(InputError, match="no inertia"):
        press(body, FREE, pairs, dynamics=falling(body, 1.0), method="paper")
    massless = Body(body.mesh, LinearElastic(YOUNG, 0.0, 0.0))
    with pytest.raises(InputError, match="density above 0"):
        press(massless, FREE, pairs, dynamics=falling(massless, 1.0))
