"""A factorisation solves as NumPy's dense solver does, for any number of right-hand sides."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from warpjld.covering.heat import DiffusionFactor, solve_diffusion
from warpjld.covering.laplacian import conducting_laplacian
from warpjld.rig import Rig


def _matrix(count: int, seed: int, pieces: int = 1) -> np.ndarray:
    """A random graph's Laplacian plus a small positive diagonal, in pieces that do not touch; scales of 1e-6 to 1e6."""
    random = np.random.default_rng(seed)
    conducted = np.where(
        random.uniform(size=(count, count)) < 6.0 / count, random.uniform(0.1, 2.0, (count, count)), 0.0
    )
    piece = np.arange(count) % pieces
    conducted = np.triu(conducted * (piece[:, None] == piece), 1)
    conducted += conducted.T
    scale = 10.0 ** random.uniform(-6.0, 6.0, count)
    return scale[:, None] * (np.diag(conducted.sum(axis=1) + random.uniform(0.01, 1.0, count)) - conducted) * scale


@pytest.mark.parametrize(("count", "columns", "pieces"), [(1, 1, 1), (40, 1, 1), (60, 8, 3), (60, 9, 1), (90, 33, 2)])
def test_solutions_are_those_of_a_dense_solver(count: int, columns: int, pieces: int) -> None:
    matrix = _matrix(count, columns, pieces)
    scale = np.sqrt(np.diag(matrix))
    right = scale[:, None] * np.random.default_rng(count).normal(size=(count, columns))
    expected = scale[:, None] * np.linalg.solve(matrix, right)
    found = DiffusionFactor(sp.csr_array(matrix)).solve(right)
    assert found.shape == (count, columns)
    np.testing.assert_allclose(scale[:, None] * found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_several_steps_at_once_are_one_after_another(built: Rig) -> None:
    hand = built.surface
    conductivity = np.random.default_rng(0).uniform(0.5, 2.0, len(hand.vertices)) * 1e-5
    laplacian, area = conducting_laplacian(hand.vertices, hand.faces, np.full(len(hand.vertices), 0.01), conductivity)
    factor = DiffusionFactor(sp.csr_array(sp.diags_array(area) + laplacian))
    right = np.random.default_rng(1).uniform(size=(len(area), 11))
    steps = right
    for _ in range(3):
        steps = factor.solve(area[:, None] * steps)
    np.testing.assert_allclose(factor.solve(right, weight=area, times=3), steps, rtol=1e-10, atol=1e-12)
    # heat of a constant stays what it is
    np.testing.assert_allclose(factor.solve(np.ones((len(area), 2)), weight=area, times=2), 1.0, rtol=1e-9)


def test_what_has_no_dominant_diagonal_is_not_solved_wrongly() -> None:
    matrix = np.array([[1.0, 4.0, 0.0], [4.0, 1.0, 0.5], [0.0, 0.5, 1.0]])
    right = np.ones((3, 2))
    try:
        found = DiffusionFactor(sp.csr_array(matrix)).solve(right)
    except ArithmeticError:
        return
    np.testing.assert_allclose(matrix @ found, right, atol=1e-12)
    assert solve_diffusion(sp.csr_array(np.diag([1.0, -1.0])), right[:2]) is None
