"""Generalised minimal residuals: matrices that are neither symmetric nor definite, and how a solve ends."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.fem import SolveStatus
from warpjld.fem.solver.krylov import minimal_residuals


def matrix(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.diag(np.linspace(-3.0, 20.0, count)) + rng.normal(size=(count, count)) / np.sqrt(count)


@pytest.mark.parametrize("count", [1, 30, 250])
def test_against_a_direct_solve(count: int) -> None:
    a = matrix(count, 1)
    b = np.random.default_rng(2).normal(size=count)
    near = np.linalg.inv(np.diag(np.diag(a)) + np.eye(count) * 0.01)
    done = minimal_residuals(lambda x: a @ x, lambda r: near @ r, b, tolerance=1e-10, iterations=400)
    assert done.status is SolveStatus.CONVERGED
    np.testing.assert_allclose(done.x, np.linalg.solve(a, b), rtol=1e-6, atol=1e-8)
    assert np.linalg.norm(b - a @ done.x) / np.linalg.norm(b) == pytest.approx(done.residual, rel=1e-3, abs=1e-14)


def test_a_perfect_preconditioner_takes_one_iteration() -> None:
    a = matrix(40, 3)
    done = minimal_residuals(lambda x: a @ x, lambda r: np.linalg.solve(a, r), np.ones(40))
    assert done.iterations == 1
    assert done.status is SolveStatus.CONVERGED


def test_what_cannot_be_solved_says_so() -> None:
    singular = np.diag([1.0, 2.0, 0.0])
    done = minimal_residuals(lambda x: singular @ x, lambda r: r, np.ones(3))
    assert done.status in (SolveStatus.STAGNATED, SolveStatus.MAX_ITERATIONS)
    assert done.residual == pytest.approx(1.0 / np.sqrt(3.0))
    assert minimal_residuals(lambda x: x, lambda r: r, np.array([np.nan])).status is SolveStatus.NOT_FINITE
    few = minimal_residuals(lambda x: matrix(40, 3) @ x, lambda r: r, np.ones(40), iterations=2)
    assert few.status is not SolveStatus.CONVERGED
    assert few.iterations == 2


def test_nothing_asked_nothing_done() -> None:
    done = minimal_residuals(lambda x: x, lambda r: r, np.zeros(5))
    assert done.status is SolveStatus.CONVERGED
    assert done.iterations == 0
