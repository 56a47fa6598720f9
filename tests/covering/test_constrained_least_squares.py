"""Constrained least squares beside SciPy's SLSQP, which goes another way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize

from warpjld.covering.constrained_least_squares import Linearised, minimise_constrained


@dataclass
class Curved:
    """r = A x + ½ bend x² − b and c = |x|² / limit − 1, on some of the parameters."""

    parameters: NDArray[np.int64]
    matrix: NDArray[np.float64]
    target: NDArray[np.float64]
    bend: float
    limit: float

    def linearised(self, x: NDArray[np.float64]) -> Linearised:
        mine = x[self.parameters]
        return Linearised(
            self.matrix @ (mine + 0.5 * self.bend * mine**2) - self.target,
            self.matrix * (1.0 + self.bend * mine),
            np.array([mine @ mine / self.limit - 1.0]),
            (2.0 * mine / self.limit)[None],
        )


def parts(seed: int, bend: float) -> list[Curved]:
    rng = np.random.default_rng(seed)
    chosen = [np.sort(rng.choice(6, 3, replace=False)) for _ in range(4)]
    return [Curved(c, rng.normal(size=(7, 3)), 3.0 * rng.normal(size=7), bend, rng.uniform(0.2, 3.0)) for c in chosen]


@pytest.mark.parametrize("bend", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(6))
def test_beside_another_minimiser(seed: int, bend: float) -> None:
    some, pull = parts(seed, bend), 0.05
    low, high = np.full(6, -0.4), np.full(6, 0.7)

    def loss(x: NDArray[np.float64]) -> float:
        return float(sum((p.linearised(x).residuals ** 2).sum() for p in some) + pull * (x**2).sum())

    constraints = [{"type": "ineq", "fun": lambda x, p=p: -p.linearised(x).constraints} for p in some]
    wanted = minimize(
        loss, np.zeros(6), method="SLSQP", bounds=list(zip(low, high, strict=True)), constraints=constraints
    )
    found = minimise_constrained(some, np.zeros(6), (low, high), np.full(6, pull), evaluations=60)
    assert found.converged
    assert loss(found.x) == pytest.approx(wanted.fun, rel=3e-3)
    assert max(p.linearised(found.x).constraints.max() for p in some) < 2e-3
    assert (found.x >= low).all()
    assert (found.x <= high).all()


def test_what_no_part_moves_stays() -> None:
    found = minimise_constrained([], np.array([0.3, 0.4]), (np.zeros(2), np.ones(2)), np.ones(2))
    np.testing.assert_array_equal(found.x, [0.3, 0.4])
    one = Curved(np.array([1]), np.ones((1, 1)), np.array([0.6]), 0.0, 9.0)
    found = minimise_constrained([one], np.array([0.3, 0.4]), (np.zeros(2), np.ones(2)), np.full(2, 1e-9))
    assert found.x == pytest.approx([0.3, 0.6])


def test_it_says_when_evaluations_run_out() -> None:
    calls: list[tuple[int, int]] = []
    found = minimise_constrained(
        parts(0, 0.2),
        np.zeros(6),
        (np.full(6, -0.4), np.full(6, 0.7)),
        np.full(6, 0.05),
        evaluations=2,
        progress=lambda *c: calls.append(c),
    )
    assert not found.converged
    assert found.evaluations == 2
    assert calls == [(2, 2)]
