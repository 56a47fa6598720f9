"""Body forces, concentrated forces, initial stresses and load instants against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.fem import Body, Centrifugal, LinearElastic, Loads, NeoHooke, ball_hexes, box_hexes, prescribe, solve
from warpjld.fem.load.loads import external_forces
from warpjld.fem.output.stress import cauchy, mises


def test_column_under_its_own_weight() -> None:
    """σ = ρ g (h − z), shortening ρ g h² / 2E, without lateral strain (ν = 0)."""
    mesh = box_hexes((0.1, 0.1, 2.0), (1, 1, 20))
    body = Body(mesh, LinearElastic(1e6, 0.0, 1200.0))
    found = solve(body, prescribe(mesh, "z-", x=0, y=0, z=0), Loads(gravity=(0, 0, -9.81)))
    top = found.displacement[mesh.node_set("z+"), 2]
    np.testing.assert_allclose(top, -1200.0 * 9.81 * 2.0**2 / 2e6, rtol=1e-6)
    assert found.reactions[:, 2].sum() == pytest.approx(1200.0 * 9.81 * 0.02, rel=1e-9)
    stress = cauchy(body, found.displacement)
    middle = mesh.nodes[mesh.elements].mean(axis=1)[:, 2]
    np.testing.assert_allclose(stress[:, 2], -1200.0 * 9.81 * (2.0 - middle), rtol=1e-6)


def test_rod_that_turns() -> None:
    """Lengthening ρ ω² L³ / 3E of a rod held at its axis (ν = 0)."""
    mesh = box_hexes((1.0, 0.05, 0.05), (40, 1, 1), origin=(0, -0.025, -0.025))
    body = Body(mesh, LinearElastic(1e6, 0.0, 1000.0))
    turn = Centrifugal(axis=(0, 0, 2.0), speed=5.0)
    held = prescribe(mesh, "x-", x=0) + prescribe(mesh, [0], y=0, z=0) + prescribe(mesh, [1], y=0)
    found = solve(body, held, Loads(centrifugal=turn), free="hold")
    lengthening = found.displacement[mesh.node_set("x+"), 0].mean()
    assert lengthening == pytest.approx(1000.0 * 25.0 / 3e6, rel=1e-3)


def test_pressure_on_a_closed_surface_has_no_resultant_and_the_right_virial() -> None:
    mesh = ball_hexes(1.3, n=8)
    body = Body(mesh, LinearElastic(1.0, 0.3))
    force = external_forces(body, Loads(pressure={"outer": 2.0})).reshape(-1, 3)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-12)
    x = mesh.nodes[mesh.quads(mesh.faces["outer"])]
    volume = np.einsum("fi,fi->", x.mean(axis=1), np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])) / 6.0
    assert (force * mesh.nodes).sum() == pytest.approx(-2.0 * 3.0 * volume, rel=5e-3)


def test_concentrated_force_is_shared_by_the_nodes() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    body = Body(mesh, LinearElastic(1.0, 0.3))
    force = external_forces(body, Loads(forces={"x+": (3.0, 0.0, -9.0)})).reshape(-1, 3)
    np.testing.assert_allclose(force[mesh.node_set("x+")], np.tile([3 / 9, 0.0, -1.0], (9, 1)))
    assert not force[mesh.node_set("x-")].any()


@pytest.mark.parametrize("law", [LinearElastic(1e5, 0.3), NeoHooke(1e5, 0.3)])
def test_initial_stress_relaxes_into_strain(law: object) -> None:
    """A free body with σ₀ deforms until it is free of stress: ε = −σ₀ / E along x, here with ν = .3 across."""
    mesh = box_hexes(counts=(2, 2, 2))
    body = Body(mesh, law, initial_stress=[10.0, 0, 0, 0, 0, 0])  # type: ignore[arg-type]
    held = prescribe(mesh, "x-", x=0) + prescribe(mesh, "y-", y=0) + prescribe(mesh, "z-", z=0)
    found = solve(body, held)
    moved = found.displacement[mesh.node_set("x+"), 0]
    np.testing.assert_allclose(moved, -10.0 / 1e5, rtol=2e-3)
    assert mises(cauchy(body, found.displacement)).max() < 1e-3
    clamped = solve(body, prescribe(mesh, "surface", x=0, y=0, z=0))
    np.testing.assert_allclose(cauchy(body, clamped.displacement)[:, 0], 10.0, rtol=1e-9)


def test_instants_and_steps_end_in_the_same_place() -> None:
    mesh = box_hexes((1, 1, 2), (2, 2, 4))
    body = Body(mesh, NeoHooke(1.0, 0.45))
    base = prescribe(mesh, "z-", x=0, y=0, z=0)
    loads = Loads(traction={"z+": (0.02, 0, 0.05)})
    once = solve(body, base, loads)
    many = solve(body, base, loads, instants=[0.2, 0.3, 1.0])
    assert [i.factor for i in many.instants] == [0.2, 0.3, 1.0]
    np.testing.assert_allclose(once.displacement, many.displacement, atol=1e-7)

    # pull by displacement, then let go: nothing is left
    pulled = solve(body, base + prescribe(mesh, "z+", z=0.3), instants=2)
    released = solve(body, base, Loads(), after=pulled, instants=3)
    half = released.instants[0].displacement[mesh.node_set("z+"), 2].mean()
    assert 0.1 < half < 0.3
    np.testing.assert_allclose(released.displacement, 0.0, atol=1e-7)


def test_steps_of_a_linear_body() -> None:
    mesh = box_hexes(counts=(2, 2, 2))
    body = Body(mesh, LinearElastic(1.0, 0.3))
    base = prescribe(mesh, "z-", x=0, y=0, z=0)
    pulled = solve(body, base + prescribe(mesh, "z+", z=0.3))
    released = solve(body, base, after=pulled, instants=2)
    assert released.instants[0].displacement[mesh.node_set("z+"), 2].mean() == pytest.approx(0.15, rel=1e-6)
    np.testing.assert_allclose(released.displacement, 0.0, atol=1e-9)


def test_same_bits_every_run() -> None:
    mesh = ball_hexes(1.0, inner=0.7, n=8)
    results = []
    for threads in (1, 2, 1):
        body = Body(mesh, NeoHooke(1.0, 0.45), threads=threads)
        held = prescribe(mesh, np.flatnonzero(mesh.nodes[:, 2] < -0.8), x=0, y=0, z=0)
        results.append(solve(body, held, Loads(pressure={"inner": 0.02}), method="multigrid").displacement)
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])
