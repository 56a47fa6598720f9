"""The multigrid preconditioner: iterations that do not grow, levels that keep rigid motions, precisions."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.fem import Body, HexMesh, LinearElastic, ball_hexes, box_hexes, finger_hexes, prescribe
from warpjld.fem.solver.hierarchy import hierarchy_of
from warpjld.fem.solver.linear import LinearSolver
from warpjld.fem.solver.multigrid import Multigrid, coarse_matrix


def iterations(mesh: HexMesh, poisson: float, fixed: str, precision: str = "float64") -> int:
    body = Body(mesh, LinearElastic(1.0, poisson))
    free = prescribe(mesh, fixed, x=0, y=0, z=0).free(body.degrees)
    stiffness = body.at().stiffness
    assert stiffness is not None
    solver = LinearSolver(stiffness, free, mesh, method="multigrid", poisson=poisson, precision=precision)
    found = solver.solve(np.tile([0.0, -1.0, 0.0], len(mesh.nodes)))
    assert found.residual <= 1e-8
    right = np.tile([0.0, -1.0, 0.0], len(mesh.nodes)) * free
    true = np.linalg.norm(right - solver.masked_product(found.x)) / np.linalg.norm(right)
    assert true == pytest.approx(found.residual, rel=1e-6)
    return found.iterations


def test_iterations_do_not_grow_with_the_mesh() -> None:
    counts = [iterations(box_hexes(counts=(n, n, n)), 0.3, "x-") for n in (8, 16, 24)]
    assert max(counts) <= 12


@pytest.mark.slow
def test_iterations_up_to_half_a_million_degrees_of_freedom() -> None:
    assert iterations(box_hexes(counts=(36, 36, 36)), 0.3, "x-") <= 12
    assert iterations(box_hexes(counts=(56, 56, 56)), 0.3, "x-") <= 12


@pytest.mark.parametrize("n", [8, 12])
def test_iterations_at_poisson_49(n: int) -> None:
    assert iterations(finger_hexes(n=n, layers=n // 2, along=2 * n), 0.49, "bone") <= 30


def test_odd_numbers_of_elements() -> None:
    assert iterations(box_hexes(counts=(15, 13, 17)), 0.3, "x-") <= 14
    assert (
        iterations(ball_hexes(n=7, inner=0.5, layers=5).with_nodes(pole=np.arange(20, dtype=np.int32)), 0.3, "pole")
        <= 30
    )


def test_single_precision_refined() -> None:
    assert iterations(box_hexes(counts=(12, 12, 12)), 0.3, "x-", "float32") <= 25


@pytest.mark.parametrize("kind", ["blocks", "lattice", "points"])
def test_weights_reproduce_linear_fields(kind: str) -> None:
    mesh = box_hexes((1, 1, 1), (12, 12, 12))
    grid = np.rint(mesh.nodes * 12).astype(np.int32)
    mesh = HexMesh(
        mesh.nodes,
        mesh.elements,
        mesh.regions,
        blocks=mesh.blocks if kind == "blocks" else (),
        lattice=grid if kind == "lattice" else None,
    )
    field = mesh.nodes @ np.array([[1.0], [2.0], [-0.5]]) + 0.3
    levels = hierarchy_of(mesh)
    assert levels
    for weights in levels:
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
        coarse, *_ = np.linalg.lstsq(weights.toarray(), field, rcond=None)
        np.testing.assert_allclose(weights @ coarse, field, atol=1e-9)
        field = coarse


def test_coarse_matrix_is_the_galerkin_product() -> None:
    from scipy.sparse import eye_array, kron

    mesh = box_hexes(counts=(9, 8, 7))
    body = Body(mesh, LinearElastic(1.0, 0.3))
    free = (prescribe(mesh, "x-", x=0) + prescribe(mesh, "y-", z=0)).free(body.degrees)
    stiffness = body.at().stiffness
    assert stiffness is not None
    weights = hierarchy_of(mesh)[0]
    transposed = weights.T.tocsr()
    transposed.indices, transposed.indptr = transposed.indices.astype(np.int32), transposed.indptr.astype(np.int32)
    wide = kron(weights, eye_array(3), format="csr")
    fine = stiffness.masked(free).to_scipy()
    exact = (wide.T @ fine @ wide).toarray()
    one = coarse_matrix(stiffness, free, weights, transposed, threads=1)
    np.testing.assert_allclose(one.to_scipy().toarray(), exact, atol=1e-13)
    two = coarse_matrix(stiffness, free, weights, transposed, threads=2)
    np.testing.assert_array_equal(one.values, two.values)


def test_cycle_is_symmetric_and_positive() -> None:
    mesh = box_hexes(counts=(10, 9, 8))
    body = Body(mesh, LinearElastic(1.0, 0.3))
    free = prescribe(mesh, "x-", x=0, y=0, z=0).free(body.degrees)
    stiffness = body.at().stiffness
    assert stiffness is not None
    cycle = Multigrid(stiffness, free, hierarchy_of(mesh), precision="float64")
    rng = np.random.default_rng(0)
    a, b = (rng.normal(size=body.degrees) * free for _ in range(2))
    assert a @ cycle(b) == pytest.approx(b @ cycle(a), rel=1e-10)
    assert a @ cycle(a) > 0
    assert not cycle(a)[~free].any()
