"""Patterns of products against SciPy's, and of meshes against their definition."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array, random_array

from warpjld.fem import HexMesh, ball_hexes
from warpjld.fem.assembly.pattern import pattern_of, triple_product


def pattern(matrix: csr_array) -> tuple[np.ndarray, np.ndarray]:
    return matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32)


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("rows", [1, 40, 300])
def test_a_product_of_three_against_scipy(rows: int, threads: int) -> None:
    rng = np.random.default_rng(rows)
    shapes = ((rows, 50), (50, 70), (70, 90))
    factors = [csr_array(random_array(shape, density=0.05, format="csr", rng=rng)) for shape in shapes]
    found = triple_product(*(pattern(factor) for factor in factors), 90, threads=threads)
    wanted = csr_array(factors[0] @ factors[1] @ factors[2])  # weights are positive: nothing cancels
    wanted.sort_indices()
    np.testing.assert_array_equal(found.rows, wanted.indptr)
    np.testing.assert_array_equal(found.columns, wanted.indices)


def test_neighbours_of_a_mesh_share_an_element() -> None:
    mesh = ball_hexes(n=4, inner=0.5, layers=3)
    found = pattern_of(mesh, threads=2)
    for node in range(0, len(mesh.nodes), 17):
        around = np.unique(mesh.elements[(mesh.elements == node).any(axis=1)])
        np.testing.assert_array_equal(found.columns[found.rows[node] : found.rows[node + 1]], around)
    blocks = found.columns[found.slots.reshape(-1, 8, 8)]
    np.testing.assert_array_equal(blocks, np.repeat(mesh.elements[:, None], 8, axis=1))


def test_a_node_may_have_any_number_of_neighbours() -> None:
    """A fan of elements about one node."""
    count = 200
    elements = np.arange(7 * count, dtype=np.int32).reshape(count, 7) + 1
    elements = np.concatenate([np.zeros((count, 1), np.int32), elements], axis=1)
    mesh = HexMesh(np.zeros((7 * count + 1, 3)), elements, np.zeros(count, np.int32), ("fan",))
    found = pattern_of(mesh)
    np.testing.assert_array_equal(found.columns[: found.rows[1]], np.arange(7 * count + 1))
