"""Gauss–Newton with bounds on sums of squares that come in parts, each of a few parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Fit", "Part", "gauss_newton"]

_SETTLED = 1e-3  # relative gain of a step below which the next is not taken
_HALVINGS = 4  # of a step that makes things worse


class Part(Protocol):
    """Residuals that some parameters determine."""

    parameters: NDArray[np.int64]

    def residuals(self, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], sp.csr_array]:
        """Numbers, shape (N,), and their derivatives by ``parameters``, shape (N, p), at all parameters x, (P,)."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What :func:`gauss_newton` found.

    Attributes:
        x: Parameters, shape (P,).
        loss: Sum of squares there, with the pull to the start.
        iterations: Steps taken.
        evaluations: Times all residuals were computed.
        converged: Whether the last step gained next to nothing; else the steps ran out.
    """

    x: NDArray[np.float64]
    loss: float
    iterations: int
    evaluations: int
    converged: bool


def gauss_newton(
    parts: Sequence[Part],
    start: NDArray[np.float64],
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]],
    pull: NDArray[np.float64],
    *,
    iterations: int = 8,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Minimise Σ |r_i(x)|² + Σ pull (x − start)² within bounds; parameters that no part names stay as they are.

    Args:
        parts: The residuals.
        start: First x, shape (P,).
        bounds: Least and largest x, shape (P,) each; the start lies within.
        pull: How much each parameter is held at its start, above 0, shape (P,).
        iterations: Most steps.
        progress: Called with parts evaluated in this step, and how many there are.
    """
    from scipy.optimize import lsq_linear

    moved = np.unique(np.concatenate([part.parameters for part in parts])) if parts else np.zeros(0, dtype=np.int64)
    low, high = (b[moved] for b in bounds)
    place = np.full(len(start), -1)
    place[moved] = np.arange(len(moved))

    def summed(x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Loss, half its gradient, and JᵀJ."""
        change = (x - start)[moved]
        value = float((pull[moved] * change**2).sum())
        gradient, square = pull[moved] * change, np.diag(pull[moved])
        for n, part in enumerate(parts):
            residual, jacobian = part.residuals(x)
            mine = place[part.parameters]
            value += float(residual @ residual)
            gradient[mine] += jacobian.T @ residual
            square[np.ix_(mine, mine)] += (jacobian.T @ jacobian).toarray()
            if progress:
                progress(n + 1, len(parts))
        return value, gradient, square

    x = start.copy()
    if not moved.size:
        return Fit(x, 0.0, 0, 0, True)
    loss, gradient, square = summed(x)
    evaluations = 1
    for step_number in range(1, iterations + 1):
        # |Lᵀ s + L⁻¹ g|² = s H s + 2 g s + constant
        lower = np.linalg.cholesky(square)
        step = lsq_linear(
            lower.T, -np.linalg.solve(lower, gradient), bounds=(low - x[moved] - 1e-12, high - x[moved] + 1e-12)
        ).x
        for _ in range(_HALVINGS):
            candidate = x.copy()
            candidate[moved] = np.clip(x[moved] + step, low, high)
            trial = summed(candidate)
            evaluations += 1
            if trial[0] < loss:
                break
            step = step / 2.0
        else:
            return Fit(x, loss, step_number - 1, evaluations, True)
        gain = loss - trial[0]
        x, (loss, gradient, square) = candidate, trial
        if gain < _SETTLED * loss:
            return Fit(x, loss, step_number, evaluations, True)
    return Fit(x, loss, iterations, evaluations, False)
