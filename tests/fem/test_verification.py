"""Analytic solutions: patch, beam, Cook's membrane, thick sphere and cylinder, convergence rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warpjld.fem import Body, HexMesh, LinearElastic, Loads, ball_hexes, box_hexes, cylinder_hexes, prescribe, solve
from warpjld.fem.load.prescribed import Prescribed

pytestmark = pytest.mark.filterwarnings("ignore::warpjld.fem.MaterialWarning")

STRAINS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]


def distorted(n: int, shift: float) -> HexMesh:
    mesh = box_hexes((1.0, 1.0, 1.0), (n, n, n))
    inside = np.setdiff1d(np.arange(len(mesh.nodes)), mesh.node_set("surface"))
    nodes = mesh.nodes.copy()
    nodes[inside] += np.random.default_rng(1).uniform(-shift, shift, (len(inside), 3))
    return replace(mesh, nodes=nodes)


def octant_planes(mesh: HexMesh) -> Prescribed:
    return prescribe(mesh, "x0", x=0.0) + prescribe(mesh, "y0", y=0.0) + prescribe(mesh, "z0", z=0.0)


@pytest.mark.parametrize("strain", STRAINS)
@pytest.mark.parametrize("method", ["direct", "multigrid", "jacobi"])
def test_patch(strain: tuple[int, int], method: str) -> None:
    mesh = distorted(4, 0.06)
    gradient = np.zeros((3, 3))
    gradient[strain] += 0.5
    gradient[strain[::-1]] += 0.5
    exact = mesh.nodes @ gradient
    surface = mesh.node_set("surface")
    held = prescribe(mesh, surface, displacement=exact[surface])
    found = solve(Body(mesh, LinearElastic(1.0, 0.3)), held, method=method, tolerance=1e-13)
    np.testing.assert_allclose(found.displacement, exact, rtol=0, atol=1e-12)


def test_patch_in_single_precision_reaches_double_residuals() -> None:
    mesh = distorted(4, 0.06)
    exact = mesh.nodes @ np.array([[0.1, 0.2, 0.0], [0.2, -0.3, 0.1], [0.0, 0.1, 0.2]])
    surface = mesh.node_set("surface")
    held = prescribe(mesh, surface, displacement=exact[surface])
    found = solve(Body(mesh, LinearElastic(1.0, 0.3)), held, method="multigrid", precision="float32", tolerance=1e-10)
    np.testing.assert_allclose(found.displacement, exact, rtol=0, atol=1e-9)


def test_cantilever_with_sheared_tip() -> None:
    length, force, young, poisson = 10.0, 1.0, 1000.0, 0.3
    mesh = box_hexes((length, 1.0, 1.0), (80, 8, 8))
    body = Body(mesh, LinearElastic(young, poisson))
    found = solve(body, prescribe(mesh, "x-", x=0, y=0, z=0), Loads(traction={"x+": (0.0, force, 0.0)}))
    beam = force * length**3 / (3 * young / 12) + 1.2 * force * length / (young / (2 * (1 + poisson)))
    assert found.displacement[mesh.node_set("x+"), 1].mean() == pytest.approx(beam, rel=0.02)
    np.testing.assert_allclose(found.reactions.sum(axis=0), [0.0, -force, 0.0], atol=1e-7)


def cook(n: int, young: float, poisson: float, force: float, *, plane_strain: bool) -> tuple[float, float]:
    mesh = box_hexes((48.0, 1.0, 1.0), (n, n, 1 if plane_strain else 2))
    nodes = mesh.nodes.copy()
    share = nodes[:, 0] / 48.0
    nodes[:, 1] = 44.0 * share + nodes[:, 1] * (44.0 - 28.0 * share)
    mesh = replace(mesh, nodes=nodes)
    held = prescribe(mesh, "x-", x=0, y=0) + prescribe(mesh, "z-", z=0)
    if plane_strain:
        held = held + prescribe(mesh, "z+", z=0)
    found = solve(Body(mesh, LinearElastic(young, poisson)), held, Loads(traction={"x+": (0, force / 16.0, 0)}))
    up = [found.displacement[np.argmin(np.linalg.norm(nodes[:, :2] - p, axis=1)), 1] for p in ([48, 52], [48, 60])]
    return up[0], up[1]


def test_cook_in_plane_stress() -> None:
    assert cook(64, 1.0, 1 / 3, 1.0, plane_strain=False)[0] == pytest.approx(23.96, rel=2e-3)


def test_cook_nearly_incompressible() -> None:
    assert cook(48, 250.0, 0.4999, 100.0, plane_strain=True)[1] == pytest.approx(7.77, rel=8e-3)


@pytest.mark.parametrize(
    ("poisson", "inside", "outside"),
    [(0.3, 0.8, 0.3), (0.45, 0.842857, 0.235714), (0.49, 0.854286, 0.218571), (0.4999, 0.857114, 0.214329)],
)
def test_lame_sphere(poisson: float, inside: float, outside: float) -> None:
    mesh = ball_hexes(2.0, inner=1.0, n=12, layers=12, octant=True)
    found = solve(Body(mesh, LinearElastic(1.0, poisson)), octant_planes(mesh), Loads(pressure={"inner": 1.0}))
    radius = np.linalg.norm(mesh.nodes, axis=1)
    outwards = (found.displacement * mesh.nodes).sum(axis=1) / radius
    assert outwards[mesh.node_set("inner")].mean() == pytest.approx(inside, rel=3e-3)
    assert outwards[mesh.node_set("outer")].mean() == pytest.approx(outside, rel=3e-3)


@pytest.mark.parametrize(("poisson", "inside", "outside"), [(0.3, 1.90667, 1.21333), (0.49, 1.9966, 1.0132)])
def test_lame_cylinder(poisson: float, inside: float, outside: float) -> None:
    mesh = cylinder_hexes(2.0, 0.25, inner=1.0, n=12, layers=12, along=2, quarter=True)
    held = prescribe(mesh, "x0", x=0.0) + prescribe(mesh, "y0", y=0.0)
    held = held + prescribe(mesh, "bottom", z=0.0) + prescribe(mesh, "top", z=0.0)
    found = solve(Body(mesh, LinearElastic(1.0, poisson)), held, Loads(pressure={"inner": 1.0}))
    radius = np.linalg.norm(mesh.nodes[:, :2], axis=1)
    outwards = (found.displacement * mesh.nodes)[:, :2].sum(axis=1) / radius
    assert outwards[mesh.node_set("inner")].mean() == pytest.approx(inside, rel=3e-3)
    assert outwards[mesh.node_set("outer")].mean() == pytest.approx(outside, rel=3e-3)


def test_locking_without_mean_dilatation() -> None:
    """The comparison that shows what B-bar is for."""
    mesh = ball_hexes(2.0, inner=1.0, n=6, layers=6, octant=True)
    law = LinearElastic(1.0, 0.4999, mean_dilatation=False)
    found = solve(Body(mesh, law), octant_planes(mesh), Loads(pressure={"inner": 1.0}))
    outwards = np.linalg.norm(found.displacement[mesh.node_set("inner")], axis=1).mean()
    assert outwards < 0.9 * 0.857114


def test_convergence_rates() -> None:
    """Manufactured solution on a distorted box: error in u falls as h² (L2), in its gradient as h (H1)."""
    from warpjld.fem.mesh.shape import POINTS, shape_at, slope_at

    young, poisson = 1.0, 0.3
    shear = young / (2 * (1 + poisson))

    def exact(x: np.ndarray) -> np.ndarray:
        return np.stack([np.sin(np.pi * x[..., 1]), np.sin(np.pi * x[..., 2]), np.sin(np.pi * x[..., 0])], axis=-1)

    def gradient(x: np.ndarray) -> np.ndarray:
        out = np.zeros((*x.shape, 3))
        for i, j in ((0, 1), (1, 2), (2, 0)):
            out[..., i, j] = np.pi * np.cos(np.pi * x[..., j])
        return out

    # div u = 0, so div σ = μ Δu = −μ π² u and the body force is μ π² u
    errors = []
    shape, slopes = shape_at(POINTS), slope_at(POINTS)
    for n in (4, 8, 16):
        mesh = box_hexes((1.0, 1.0, 1.0), (n, n, n))
        bent = mesh.nodes + 0.04 * np.sin(2 * np.pi * mesh.nodes[:, [1, 2, 0]]) * np.sin(np.pi * mesh.nodes)
        mesh = replace(mesh, nodes=bent)
        x = mesh.nodes[mesh.elements]
        load = np.zeros_like(mesh.nodes)
        parts = []
        for q, local in enumerate(slopes):
            jacobian = np.einsum("eai,aj->eij", x, local)
            volume = np.linalg.det(jacobian)
            at = np.einsum("a,eai->ei", shape[q], x)
            parts.append((q, np.einsum("aj,eji->eai", local, np.linalg.inv(jacobian)), volume, at))
            force = shear * np.pi**2 * exact(at) * volume[:, None]
            np.add.at(load, mesh.elements, shape[q][None, :, None] * force[:, None, :])
        surface = mesh.node_set("surface")
        held = prescribe(mesh, surface, displacement=exact(mesh.nodes[surface]))
        body = Body(mesh, LinearElastic(young, poisson, mean_dilatation=False))
        u = solve(body, held, Loads(nodal=load)).displacement[mesh.elements]
        low = high = 0.0
        for q, slope, volume, at in parts:
            low += (volume * ((shape[q] @ u - exact(at)) ** 2).sum(axis=1)).sum()
            wrong = np.einsum("eaj,eai->eij", slope, u) - gradient(at)
            high += (volume * (wrong**2).sum(axis=(1, 2))).sum()
        errors.append((np.sqrt(low), np.sqrt(high)))
    rate = np.log2(np.array(errors[1]) / np.array(errors[2]))
    assert rate[0] == pytest.approx(2.0, abs=0.12)
    assert rate[1] == pytest.approx(1.0, abs=0.12)
