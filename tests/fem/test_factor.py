"""Sparse Cholesky factors against dense linear algebra, and against themselves on other threads and after others."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array

from warpjld.fem import Body, HexMesh, LinearElastic, SolveStatus, box_hexes, merge
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError
from warpjld.fem.solver.elimination import eliminate
from warpjld.fem.solver.factor import CostlyError, Factor
from warpjld.fem.solver.linear import LinearSolver


def _stiffness(mesh: HexMesh) -> tuple[BlockMatrix, np.ndarray]:
    """Of a block that is held at one end, one node of it in one direction only."""
    matrix = Body(mesh, LinearElastic(1.0, 0.45), threads=1).at().stiffness
    assert matrix is not None
    free = np.ones((matrix.size, 3), dtype=bool)
    held = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    free[held] = False
    free[held[0], 1:] = True
    return matrix, free.reshape(-1)


def _dense(matrix: BlockMatrix, free: np.ndarray) -> np.ndarray:
    return np.asarray(matrix.to_scipy().todense())[np.ix_(free, free)]


@pytest.mark.parametrize("counts", [(1, 1, 1), (3, 2, 1), (9, 4, 5)])
def test_it_solves(counts: tuple[int, int, int]) -> None:
    matrix, free = _stiffness(box_hexes((1.0, 0.5, 0.7), counts))
    right = np.random.default_rng(1).normal(size=len(free))
    found = Factor(matrix, free, threads=1).solve(right)
    assert (found[~free] == 0.0).all()
    want = np.linalg.solve(_dense(matrix, free), right[free])
    np.testing.assert_allclose(found[free], want, rtol=1e-9, atol=1e-9 * np.abs(want).max())


def test_bodies_that_nothing_joins() -> None:
    one = box_hexes((1.0, 0.5, 0.7), (4, 3, 2))
    two = box_hexes((1.0, 0.5, 0.7), (2, 5, 3), origin=(0.0, 2.0, 0.0))
    matrix, free = _stiffness(merge(one, two))
    right = np.random.default_rng(2).normal(size=len(free))
    want = np.linalg.solve(_dense(matrix, free), right[free])
    found = Factor(matrix, free, threads=1).solve(right)[free]
    np.testing.assert_allclose(found, want, rtol=1e-9, atol=1e-9 * np.abs(want).max())


def test_the_same_bits_on_any_threads_and_after_others() -> None:
    matrix, free = _stiffness(box_hexes((1.0, 1.0, 1.0), (9, 9, 9)))
    right = np.random.default_rng(3).normal(size=len(free))
    one, two = (Factor(matrix, free, threads=threads).solve(right) for threads in (1, 2))
    assert one.tobytes() == two.tobytes()
    softer = BlockMatrix(matrix.rows, matrix.columns, 0.5 * matrix.values)
    after = Factor(matrix, free, threads=2, reuse=Factor(softer, free, threads=1)).solve(right)
    assert after.tobytes() == one.tobytes()


def test_what_no_front_has_room_for_gets_a_new_order() -> None:
    matrix, free = _stiffness(box_hexes((1.0, 0.5, 0.5), (8, 3, 3)))
    first = Factor(matrix, free, threads=1)
    full = matrix.to_scipy().tolil()
    a, b = 3 * (matrix.size - 1), 3 * (matrix.size // 3)  # two nodes far apart, tied
    for k in range(3):
        full[a + k, a + k] += 0.2
        full[b + k, b + k] += 0.2
        full[a + k, b + k] -= 0.2
        full[b + k, a + k] -= 0.2
    blocks = full.tobsr((3, 3))
    blocks.sort_indices()
    tied = BlockMatrix(
        blocks.indptr.astype(np.int32), blocks.indices.astype(np.int32), np.ascontiguousarray(blocks.data)
    )
    right = np.random.default_rng(4).normal(size=len(free))
    want = np.linalg.solve(_dense(tied, free), right[free])
    second = Factor(tied, free, threads=1, reuse=first)
    np.testing.assert_allclose(second.solve(right)[free], want, rtol=1e-9, atol=1e-9 * np.abs(want).max())
    third = Factor(matrix, free, threads=1, reuse=second)  # that has room for less
    assert third.elimination is second.elimination
    want = np.linalg.solve(_dense(matrix, free), right[free])
    np.testing.assert_allclose(third.solve(right)[free], want, rtol=1e-9, atol=1e-9 * np.abs(want).max())


def test_what_is_not_positive_definite_is_named() -> None:
    matrix, free = _stiffness(box_hexes((1.0, 0.5, 0.5), (4, 3, 3)))
    loose = np.ones(len(free), dtype=bool)
    shifted = matrix.values.copy()
    shifted[matrix.on_diagonal] -= 1e-3 * np.eye(3)
    with pytest.raises(IndefiniteError, match="positive definite"):
        Factor(BlockMatrix(matrix.rows, matrix.columns, shifted), loose, threads=1)
    assert np.linalg.eigvalsh(_dense(BlockMatrix(matrix.rows, matrix.columns, shifted), loose)).min() < 0.0
    Factor(matrix, free, threads=1)


def test_a_factor_that_costs_more_than_allowed_is_refused_before_it_is_made() -> None:
    matrix, free = _stiffness(box_hexes((1.0, 0.5, 0.5), (4, 3, 3)))
    work = Factor(matrix, free, threads=1).elimination.work
    with pytest.raises(CostlyError, match="multiplications"):
        Factor(matrix, free, threads=1, most=0.99 * work)
    assert Factor(matrix, free, threads=1, most=work).elimination.work == work


def test_orders_are_complete_and_fill_is_low() -> None:
    matrix, free = _stiffness(box_hexes((1.0, 1.0, 1.0), (8, 8, 8)))
    active = free.reshape(-1, 3).any(axis=1)
    found = eliminate(matrix.rows, matrix.columns, active)
    assert sorted(found.order) == np.flatnonzero(active).tolist()
    np.testing.assert_array_equal(found.place[found.order], np.arange(len(found.order)))
    assert (found.place[~active] == -1).all()
    done = np.concatenate([found.early[0], found.late[0]])
    assert sorted(done) == list(range(len(found.tables["first"]) - 1))
    dense = 3.0 * active.sum()
    assert found.work < 0.35 * dense**3 / 3.0


@pytest.mark.parametrize("size", [0.0, 1e-9, 3.0])
def test_beside_a_non_symmetric_part_of_few_rows(size: float) -> None:
    mesh = box_hexes((1.0, 0.5, 0.7), (6, 3, 3))
    matrix, free = _stiffness(mesh)
    rng = np.random.default_rng(4)
    rows = rng.choice(len(free), size=12, replace=False)
    part = np.zeros((len(free), len(free)))
    part[np.ix_(rows, rows)] = size * rng.normal(size=(12, 12))
    right = rng.normal(size=len(free))
    solver = LinearSolver(matrix, free, mesh, method="direct", threads=1)
    done = solver.solve_nonsymmetric(csr_array(part), right, tolerance=1e-10, iterations=40)
    want = np.linalg.solve(_dense(matrix, free) + part[np.ix_(free, free)], right[free])
    assert done.status is SolveStatus.CONVERGED
    assert done.residual <= 2e-10
    assert done.iterations <= 13
    assert (done.x[~free] == 0.0).all()
    np.testing.assert_allclose(done.x[free], want, rtol=1e-6, atol=1e-7 * np.abs(want).max())


def test_solving_between_some_degrees_of_freedom_takes_fewer_fronts_and_gives_the_same_bits() -> None:
    matrix, free = _stiffness(box_hexes((3.0, 1.0, 1.0), (14, 5, 5)))
    factor = Factor(matrix, free, threads=1)
    face = np.flatnonzero(np.repeat(np.arange(matrix.size) < 6, 3))
    rows, columns = face[1::2], np.concatenate([face[:5], [200, len(free) - 1]])
    right = np.zeros(len(free))
    right[rows[free[rows]]] = np.random.default_rng(5).normal(size=int(free[rows].sum()))
    found = factor.between(rows, columns)(right[rows])
    assert np.array_equal(found, factor.solve(right)[columns])
    assert found.any()
    fronts = factor.elimination.above(factor.elimination.place[[3, 5]])
    assert 0 < len(fronts) < len(factor.elimination.parent)
    assert set(factor.elimination.parent[fronts].tolist()) <= {*fronts.tolist(), -1}
