"""Sums of squares that come in parts, each of a few parameters, minimised within bounds: Gauss–Newton, damped as by
Levenberg and Marquardt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Fit", "Part", "gauss_newton"]

_SETTLED = 1e-3  # relative gain of a step below which the next is not taken
_DAMPING = 1e-2  # of the diagonal of JᵀJ, at first
_RELAXED, _TIGHTENED = 5.0, 8.0  # what it is divided by after a step that gained, multiplied by after one that did not
_STUCK = 1e3  # damping beyond which no step is tried


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
    iterations: int = 12,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Minimise Σ |r_i(x)|² + Σ pull (x − start)² within bounds; parameters that no part names stay as they are.

    Args:
        parts: The residuals.
        start: First x, shape (P,).
        bounds: Least and largest x, shape (P,) each; the start lies within.
        pull: How much each parameter is held at its start, above 0, shape (P,).
        iterations: Most steps tried.
        progress: Called with parts evaluated in this step, and how many there are.
    """
    moved = np.unique(np.concatenate([part.parameters for part in parts])) if parts else np.zeros(0, dtype=np.int64)
    place = np.full(len(start), -1)
    place[moved] = np.arange(len(moved))
    low, high, held = bounds[0][moved], bounds[1][moved], pull[moved]

    def summed(x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """Loss, half its gradient, and JᵀJ."""
        change = (x - start)[moved]
        value = float((held * change**2).sum())
        gradient, square = held * change, np.diag(held)
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
    damping, evaluations, taken = _DAMPING, 1, 0
    while evaluations <= iterations:
        damped = square + damping * np.diag(np.diag(square))
        candidate = x.copy()
        candidate[moved] = np.clip(x[moved] + _step(damped, gradient, low - x[moved], high - x[moved]), low, high)
        trial = summed(candidate)
        evaluations += 1
        gain = loss - trial[0]
        if gain > 0.0:
            x, (loss, gradient, square) = candidate, trial
            taken += 1
            damping /= _RELAXED
            if gain < _SETTLED * loss:
                return Fit(x, loss, taken, evaluations, True)
        else:
            damping *= _TIGHTENED
            if damping > _STUCK:
                return Fit(x, loss, taken, evaluations, True)
    return Fit(x, loss, taken, evaluations, False)


def _step(
    square: NDArray[np.float64], gradient: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The s between bounds that makes s · square · s + 2 gradient · s small: what runs into a bound stays on it."""
    step = np.zeros(len(gradient))
    free = np.ones(len(gradient), dtype=bool)
    while free.any():
        rest = gradient[free] + square[np.ix_(free, ~free)] @ step[~free]
        wanted = np.linalg.solve(square[np.ix_(free, free)], -rest)
        out = (wanted < low[free]) | (wanted > high[free])
        step[free] = np.clip(wanted, low[free], high[free])
        if not out.any():
            break
        free[np.flatnonzero(free)[out]] = False
    return step
