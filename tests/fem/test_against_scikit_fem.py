"""Stiffness and solution against scikit-fem and a sparse direct solve on the same mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from warpjld.fem import Body, LinearElastic, Loads, box_hexes, prescribe, solve

skfem = pytest.importorskip("skfem")

YOUNG, POISSON = 2.5, 0.3


@pytest.fixture(scope="module")
def body() -> Body:
    mesh = box_hexes((1.0, 0.8, 0.6), (5, 4, 3))
    rng = np.random.default_rng(0)
    mesh = replace(mesh, nodes=mesh.nodes + rng.uniform(-0.02, 0.02, mesh.nodes.shape))
    return Body(mesh, LinearElastic(YOUNG, POISSON, mean_dilatation=False))


@pytest.fixture(scope="module")
def theirs(body: Body) -> np.ndarray:
    """Their stiffness in our numbering."""
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    # skfem's corners: 000, 001, 010, 100, 011, 101, 110, 111 as (x, y, z) bits
    bits = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    reference = skfem.MeshHex().p.T
    order = [int(np.flatnonzero((bits == corner).all(axis=1))[0]) for corner in np.round(reference)]
    mesh = skfem.MeshHex(body.mesh.nodes.T, body.mesh.elements[:, order].T)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)
    matrix = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis).toarray()
    numbers = basis.nodal_dofs.T.ravel()
    return matrix[np.ix_(numbers, numbers)]


def test_stiffness(body: Body, theirs: np.ndarray) -> None:
    stiffness = body.at().stiffness
    assert stiffness is not None
    ours = stiffness.to_scipy().toarray()
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-13 * np.abs(theirs).max())


@pytest.mark.parametrize("method", ["direct", "multigrid", "aggregation", "jacobi"])
def test_solution(body: Body, theirs: np.ndarray, method: str) -> None:
    if method == "aggregation":
        pytest.importorskip("pyamg")
    mesh = body.mesh
    held = prescribe(mesh, "x-", x=0.0, y=0.0, z=0.0) + prescribe(mesh, "x+", y=0.1)
    found = solve(body, held, Loads(nodal=np.ones(mesh.nodes.shape)), method=method, tolerance=1e-12)
    free = held.free(body.degrees)
    known = held.full(body.degrees)
    u = known.copy()
    u[free] = np.linalg.solve(theirs[np.ix_(free, free)], (np.ones(body.degrees) - theirs @ known)[free])
    np.testing.assert_allclose(found.displacement.ravel(), u, rtol=0, atol=1e-9 * np.abs(u).max())
    reactions = np.where(free, 0.0, theirs @ u - 1.0)
    np.testing.assert_allclose(found.reactions.ravel(), reactions, rtol=0, atol=1e-9 * np.abs(reactions).max())
    stiffness = body.at().stiffness
    assert stiffness is not None
    matrix = stiffness.to_scipy().tocsr()
    direct = spsolve(matrix[free][:, free].tocsc(), (1.0 - matrix @ known)[free])
    np.testing.assert_allclose(found.displacement.ravel()[free], direct, rtol=0, atol=1e-9 * np.abs(u).max())


def test_same_bits_however_rows_are_shared() -> None:
    mesh = box_hexes(counts=(9, 8, 7))
    law = LinearElastic(YOUNG, POISSON)
    first = Body(mesh, law, threads=1).at()
    assert first.stiffness is not None
    for threads in (2, 3):
        again = Body(mesh, law, threads=threads).at()
        assert again.stiffness is not None
        np.testing.assert_array_equal(first.stiffness.values, again.stiffness.values)
        np.testing.assert_array_equal(first.forces, again.forces)
