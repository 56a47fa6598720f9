"""Large strain: exact tangents, the elastica, inflated rubber, following pressure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warpjld.fem import (
    Body,
    Fung,
    LinearElastic,
    Loads,
    Material,
    MooneyRivlin,
    NeoHooke,
    SolveStatus,
    ball_hexes,
    box_hexes,
    prescribe,
    solve,
)
from warpjld.fem.load.loads import external_forces, subtract_pressure_stiffness
from warpjld.fem.output.stress import cauchy

pytestmark = pytest.mark.filterwarnings("ignore::warpjld.fem.MaterialWarning")


@pytest.mark.parametrize(
    "law",
    [
        NeoHooke(1.0, 0.4),
        NeoHooke(1.0, 0.4, mean_dilatation=False),
        MooneyRivlin(0.3, 0.2, 0.45),
        Fung(1.0, 3.0, 0.4),
        LinearElastic(1.0, 0.3),
    ],
)
def test_tangent_against_finite_differences(law: Material) -> None:
    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    rng = np.random.default_rng(0)
    body = Body(mesh, law, initial_stress=[0.1, 0.2, 0.05, 0.03, 0.02, 0.01])
    u = rng.uniform(-0.06, 0.06, body.degrees)
    direction = rng.normal(size=body.degrees)
    stiffness = body.at(u).stiffness
    assert stiffness is not None
    step = 1e-6 * direction
    slope = (body.at(u + step).forces - body.at(u - step).forces) / 2e-6
    np.testing.assert_allclose(stiffness.product(direction), slope, atol=1e-8 * np.abs(slope).max())


def test_pressure_stiffness_against_finite_differences() -> None:
    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    rng = np.random.default_rng(0)
    body = Body(mesh, NeoHooke(1.0, 0.4))
    loads = Loads(pressure={"surface": 1.0})
    u = rng.uniform(-0.06, 0.06, body.degrees)
    direction = rng.normal(size=body.degrees)
    stiffness = body.at(u).stiffness
    assert stiffness is not None
    stiffness.values[:] = 0.0
    subtract_pressure_stiffness(stiffness, body, loads, u)
    step = 1e-6 * direction
    slope = (external_forces(body, loads, u + step) - external_forces(body, loads, u - step)) / 2e-6
    np.testing.assert_allclose(-stiffness.product(direction), slope, atol=1e-8 * np.abs(slope).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "deflection", "shortening"),
    [(1, 0.30172, 0.05643), (2, 0.49346, 0.16064), (4, 0.66996, 0.32894), (10, 0.81061, 0.55500)],
)
def test_elastica(load: float, deflection: float, shortening: float) -> None:
    length, young = 40.0, 1000.0
    mesh = box_hexes((length, 1.0, 1.0), (320, 8, 1))
    force = load * young / 12.0 / length**2
    found = solve(
        Body(mesh, NeoHooke(young, 0.0)),
        prescribe(mesh, "x-", x=0, y=0, z=0),
        Loads(traction={"x+": (0, force, 0)}),
        instants=4,
    )
    tip = found.displacement[mesh.node_set("x+")].mean(axis=0) / length
    assert tip[1] == pytest.approx(deflection, rel=0.01)
    assert -tip[0] == pytest.approx(shortening, rel=0.01)


@pytest.mark.parametrize(
    ("stretch", "pressure"),
    [
        (1.05, 0.083654),
        (1.1, 0.144424),
        (1.2, 0.219506),
        (1.5, 0.275019),
        (2.0, 0.23838),
    ],
)
def test_inflated_shell_beyond_its_limit_point(stretch: float, pressure: float) -> None:
    """The inner wall's radius is prescribed, so that the pressure may fall; reactions give it."""
    mesh = ball_hexes(1.0, inner=0.8, n=4, layers=6, octant=True)
    poisson = 0.4999
    body = Body(mesh, NeoHooke(2.0 * (1.0 + poisson), poisson))
    wall = mesh.node_set("inner")
    held = prescribe(mesh, wall, displacement=(stretch - 1.0) * mesh.nodes[wall])
    held = held + prescribe(mesh, "x0", x=0) + prescribe(mesh, "y0", y=0) + prescribe(mesh, "z0", z=0)
    found = solve(body, held, instants=max(1, round((stretch - 1.0) / 0.1)))
    # the pressure that does the same work on the faceted wall
    unit = external_forces(body, Loads(pressure={"inner": 1.0}), found.displacement).reshape(-1, 3)
    outwards = mesh.nodes[wall]
    found_pressure = (found.reactions[wall] * outwards).sum() / (unit[wall] * outwards).sum()
    assert found_pressure == pytest.approx(pressure, rel=0.01)


@pytest.mark.parametrize(("stretch", "pressure"), [(1.05, 0.083654), (1.1, 0.144424), (1.2, 0.219506)])
def test_shell_under_following_pressure(stretch: float, pressure: float) -> None:
    mesh = ball_hexes(1.0, inner=0.8, n=4, layers=4, octant=True)
    poisson = 0.4999
    body = Body(mesh, NeoHooke(2.0 * (1.0 + poisson), poisson))
    held = prescribe(mesh, "x0", x=0) + prescribe(mesh, "y0", y=0) + prescribe(mesh, "z0", z=0)
    found = solve(body, held, Loads(pressure={"inner": pressure}), instants=4)
    wall = mesh.node_set("inner")
    radius = np.linalg.norm((mesh.nodes + found.displacement)[wall], axis=1).mean()
    assert radius / 0.8 == pytest.approx(stretch, rel=2e-3)


@pytest.mark.parametrize(
    "law",
    [NeoHooke(1.0, 0.3), NeoHooke(1.0, 0.3, mean_dilatation=False), MooneyRivlin(0.1, 0.09, 0.3), Fung(1.0, 5.0, 0.3)],
)
def test_turning_as_a_whole_costs_nothing(law: Material) -> None:
    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    angle = 2.0
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    u = mesh.nodes @ turn.T - mesh.nodes
    assert np.abs(Body(mesh, law).at(u, stiffness=False).forces).max() < 1e-14


@pytest.mark.parametrize("strain", [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)])
def test_patch_with_full_integration(strain: tuple[int, int]) -> None:
    """A uniform deformation of a fifth on a distorted mesh, and its stress, μ dev b̄ / J + κ (J − 1)."""
    mesh = box_hexes((1.0, 1.0, 1.0), (3, 3, 3))
    inside = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.node_set("surface"))
    nodes = mesh.nodes.copy()
    nodes[inside] += np.random.default_rng(1).uniform(-0.05, 0.05, (len(inside), 3))
    mesh = replace(mesh, nodes=nodes)
    gradient = np.zeros((3, 3))
    gradient[strain] = 0.2
    exact = nodes @ gradient.T
    surface = mesh.node_set("surface")
    body = Body(mesh, NeoHooke(1.0, 0.3, mean_dilatation=False))
    found = solve(body, prescribe(mesh, surface, displacement=exact[surface]), tolerance=1e-12)
    np.testing.assert_allclose(found.displacement, exact, rtol=0, atol=1e-11)
    f = np.eye(3) + gradient
    volume = np.linalg.det(f)
    b = f @ f.T * volume ** (-2.0 / 3.0)
    stress = (b - np.trace(b) / 3.0 * np.eye(3)) / 2.6 / volume + (volume - 1.0) / 1.2 * np.eye(3)
    expected = [stress[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
    np.testing.assert_allclose(cauchy(body, found.displacement), np.tile(expected, (27, 1)), atol=1e-10)


def test_full_integration_locks() -> None:
    """A shell of nearly incompressible rubber that its own mean-dilatation element swells to 1.1."""
    mesh = ball_hexes(1.0, inner=0.8, n=4, layers=2, octant=True)
    held = prescribe(mesh, "x0", x=0) + prescribe(mesh, "y0", y=0) + prescribe(mesh, "z0", z=0)
    wall = mesh.node_set("inner")
    swollen = []
    for mean_dilatation in (True, False):
        body = Body(mesh, NeoHooke(2.9998, 0.4999, mean_dilatation=mean_dilatation))
        found = solve(body, held, Loads(pressure={"inner": 0.144424}), instants=4)
        swollen.append(np.linalg.norm((mesh.nodes + found.displacement)[wall], axis=1).mean() / 0.8 - 1.0)
    assert swollen[0] == pytest.approx(0.1, rel=0.05)
    assert swollen[1] < 0.5 * swollen[0]


def test_uniform_stretch_of_mooney_rivlin() -> None:
    """Incompressible uniaxial tension: P = 2 (λ − λ⁻²)(c₁₀ + c₀₁/λ)."""
    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    c10, c01, stretch = 0.3, 0.15, 1.8
    held = prescribe(mesh, "x-", x=0) + prescribe(mesh, "y-", y=0) + prescribe(mesh, "z-", z=0)
    held = held + prescribe(mesh, "x+", x=stretch - 1.0)
    found = solve(Body(mesh, MooneyRivlin(c10, c01, 0.4999)), held, instants=4)
    pull = found.reactions[mesh.node_set("x+"), 0].sum()
    assert pull == pytest.approx(2 * (stretch - stretch**-2) * (c10 + c01 / stretch), rel=2e-3)


def test_uniform_stretch_of_fung() -> None:
    """Incompressible uniaxial tension: P = μ exp(β (λ² + 2/λ − 3)) (λ − λ⁻²), true stress λ P."""
    mesh = box_hexes((1.0, 1.0, 1.0), (2, 2, 2))
    beta, stretch = 2.0, 1.4
    held = prescribe(mesh, "x-", x=0) + prescribe(mesh, "y-", y=0) + prescribe(mesh, "z-", z=0)
    held = held + prescribe(mesh, "x+", x=stretch - 1.0)
    body = Body(mesh, Fung(3.0, beta, 0.4999))
    found = solve(body, held, instants=4)
    pull = found.reactions[mesh.node_set("x+"), 0].sum()
    law = np.exp(beta * (stretch**2 + 2 / stretch - 3)) * (stretch - stretch**-2)
    assert pull == pytest.approx(law, rel=2e-3)
    np.testing.assert_allclose(cauchy(body, found.displacement)[:, 0], stretch * law, rtol=2e-3)


def test_too_much_pressure_says_so() -> None:
    mesh = ball_hexes(1.0, inner=0.8, n=2, layers=2, octant=True)
    held = prescribe(mesh, "x0", x=0) + prescribe(mesh, "y0", y=0) + prescribe(mesh, "z0", z=0)
    found = solve(Body(mesh, NeoHooke(2.9, 0.45)), held, Loads(pressure={"inner": 0.6}), instants=4, check=False)
    assert found.status is SolveStatus.LIMIT_LOAD
    assert "limit load: above" in found.message
    assert 0.2 < found.last.factor < 0.6
