"""Chebyshev smoothing against the polynomial, and its highest eigenvalue against a dense solver."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.chebyshev import Chebyshev
from scipy.linalg import block_diag, eigh

from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.solver.smoother import chebyshev_steps, highest_eigenvalue


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_errors_shrink_by_the_chebyshev_polynomial(degree: int) -> None:
    low, high = 0.4, 3.0
    polynomial = Chebyshev.basis(degree)
    for value in (0.1, 0.4, 1.3, 2.2, 3.0):
        x = step = 0.0
        for momentum, scale in chebyshev_steps(degree, low, high):
            step = momentum * step + scale * (1.0 - value * x)
            x += step
        there, origin = ((low + high - 2.0 * v) / (high - low) for v in (value, 0.0))
        assert 1.0 - value * x == pytest.approx(polynomial(there) / polynomial(origin), abs=1e-12)


def test_the_highest_eigenvalue_is_found_among_close_ones_and_one_apart() -> None:
    count = 40
    rng = np.random.default_rng(3)
    blocks = rng.normal(size=(count, 3, 3))
    diagonal = np.einsum("nij,nkj->nik", blocks, blocks) + 2.0 * np.eye(3)
    diagonal[7] *= 50.0
    rows, columns, values = [0], [], []
    for k in range(count):
        near = [j for j in (k - 1, k, k + 1) if 0 <= j < count]
        columns += near
        values += [diagonal[k] if j == k else -0.4 * np.eye(3) for j in near]
        rows.append(len(columns))
    matrix = BlockMatrix(np.array(rows, np.int32), np.array(columns, np.int32), np.array(values))
    inverse = np.linalg.inv(diagonal)
    exact = eigh(matrix.to_scipy().toarray(), block_diag(*diagonal), eigvals_only=True)[-1]
    assert highest_eigenvalue(matrix, inverse, 1, rounds=60) == pytest.approx(exact, rel=1e-6)
    assert 0.9 * exact < highest_eigenvalue(matrix, inverse, 1) <= exact * (1.0 + 1e-9)
