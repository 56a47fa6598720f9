"""Non-linear least squares under inequality constraints: sequential quadratic programming with the Gauss–Newton
Hessian, and Levenberg–Marquardt damping of steps that do not lessen the merit function.

Each step solves the quadratic program

    min ½ s·H s + g·s,   c + C s ≤ 0,   low ≤ x + s ≤ high,   H = JᵀJ + pull

as a least distance problem, which reduces to non-negative least squares in the multipliers λ of the constraints, with
s = −H⁻¹ (g + Cᵀ λ) (Lawson and Hanson, *Solving Least Squares Problems*, §23). Residuals and constraints are given in
blocks that depend on a few parameters each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["ConstrainedFit", "Linearised", "ResidualBlock", "minimise_constrained"]

_SETTLED = 1e-3  # relative decrease of the merit function below which the iteration ends
_VIOLATED = 1e-3  # sum of constraint violations above which it goes on all the same
_SHORTER = 0.4  # factor of a rejected step, tried before damping
_LEAST, _MOST, _DAMPED = 0.1, 1e3, 10.0
"""Smallest and largest damping, relative to the diagonal of H, and the factor from one value to the next."""

_TOUCH = 1e-9  # tolerated violation of a linearised constraint by a step
_IMPOSSIBLE = 1e-9  # residual of the non-negative least squares below which the constraints are infeasible
_SLACK = 0.02  # largest violation of a constraint by an accepted step, unless the violation was larger before
_MULTIPLIED = 2.0  # weight of violations in the merit function, relative to the largest multiplier


@dataclass(frozen=True, eq=False)
class Linearised:
    """A block linearised at some parameters: N residuals and M constraints of p parameters.

    Attributes:
        residuals: r, shape (N,): their sum of squares is minimised.
        jacobian: dr/dx, shape (N, p).
        constraints: c, shape (M,): wanted ≤ 0.
        slopes: dc/dx, shape (M, p).
    """

    residuals: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    constraints: NDArray[np.float64]
    slopes: NDArray[np.float64]


class ResidualBlock(Protocol):
    """Residuals and constraints that depend on the parameters of the indices ``parameters``, shape (p,)."""

    parameters: NDArray[np.int64]

    def linearised(self, x: NDArray[np.float64]) -> Linearised:
        """Values at all parameters x, shape (P,), and derivatives by those of ``parameters``."""


@dataclass(frozen=True, eq=False)
class ConstrainedFit:
    """Result of :func:`minimise_constrained`.

    Attributes:
        x: Parameters, shape (P,).
        iterations: Steps taken.
        evaluations: Times all blocks were linearised.
        converged: Whether the decrease fell below the tolerance; else the limit of evaluations was reached.
    """

    x: NDArray[np.float64]
    iterations: int
    evaluations: int
    converged: bool


@dataclass(frozen=True, eq=False)
class _Sum:
    """Half the sum of squares and the constraints of all blocks, with derivatives by the parameters they depend on."""

    loss: float
    gradient: NDArray[np.float64]
    square: NDArray[np.float64]
    constraints: NDArray[np.float64]
    slopes: NDArray[np.float64]

    @property
    def worst(self) -> float:
        return float(self.constraints.max(initial=0.0))

    @property
    def violated(self) -> float:
        return float(np.maximum(self.constraints, 0.0).sum())


def minimise_constrained(
    parts: Sequence[ResidualBlock],
    start: NDArray[np.float64],
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]],
    pull: NDArray[np.float64],
    *,
    evaluations: int = 12,
    progress: Callable[[int, int], None] | None = None,
) -> ConstrainedFit:
    """Minimise ½ Σ |r(x)|² + ½ Σ pull (x − start)² under c(x) ≤ 0 and within bounds.

    Args:
        parts: Blocks of residuals and constraints; parameters that none of them depends on do not change.
        start: First x, shape (P,), where constraints and bounds hold.
        bounds: Lower and upper bounds of x, shape (P,) each.
        pull: Weight of each parameter's squared change, above 0, shape (P,).
        evaluations: Limit of the times that all blocks are linearised.
        progress: Called with the number of evaluations done, and their limit.
    """
    moved = np.unique(np.concatenate([part.parameters for part in parts])) if parts else np.zeros(0, dtype=np.int64)
    place = np.full(len(start), -1)
    place[moved] = np.arange(len(moved))
    low, high, held = bounds[0][moved], bounds[1][moved], pull[moved]

    def summed(x: NDArray[np.float64]) -> _Sum:
        """All blocks and the regularisation, linearised at x."""
        change = (x - start)[moved]
        loss = float((held * change**2).sum())
        gradient, square = held * change, np.diag(held)
        constraints, slopes = [], []
        for part in parts:
            local = part.linearised(x)
            own = place[part.parameters]
            loss += float(local.residuals @ local.residuals)
            gradient[own] += local.jacobian.T @ local.residuals
            square[np.ix_(own, own)] += local.jacobian.T @ local.jacobian
            rows = np.zeros((len(local.constraints), len(moved)))
            rows[:, own] = local.slopes
            constraints.append(local.constraints)
            slopes.append(rows)
        return _Sum(0.5 * loss, gradient, square, np.concatenate(constraints), np.concatenate(slopes))

    x = start.copy()
    if not moved.size:
        return ConstrainedFit(x, 0, 0, True)
    here = summed(x)
    done, taken, weight, damping, length = 1, 0, 0.0, 0.0, 1.0
    while done < evaluations:
        step, largest = _step(here, damping, low - x[moved], high - x[moved])
        weight = max(weight, _MULTIPLIED * largest)
        merit = here.loss + weight * here.violated
        if _predicted(here, step) + weight * here.violated < _SETTLED * merit and here.violated < _VIOLATED:
            return ConstrainedFit(x, taken, done, True)
        candidate = x.copy()
        candidate[moved] = np.clip(x[moved] + length * step, low, high)
        there = summed(candidate)
        done += 1
        if progress:
            progress(done, evaluations)
        gain = merit - there.loss - weight * there.violated
        if gain > 0.0 and there.worst <= max(here.worst, _SLACK):
            x, here, taken, length = candidate, there, taken + 1, 1.0
            damping = damping / _DAMPED if damping > _LEAST else 0.0
            if gain < _SETTLED * merit and here.violated < _VIOLATED:
                return ConstrainedFit(x, taken, done, True)
        elif length == 1.0:
            length = _SHORTER
        else:
            damping, length = max(_DAMPED * damping, _LEAST), 1.0
            if damping > _MOST:
                return ConstrainedFit(x, taken, done, True)
    return ConstrainedFit(x, taken, done, False)


def _predicted(here: _Sum, step: NDArray[np.float64]) -> float:
    """Decrease of the quadratic model of the loss by a step."""
    return -float(here.gradient @ step + 0.5 * step @ (here.square @ step))


def _step(
    here: _Sum, damping: float, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Solution of the quadratic program, and the largest multiplier of its constraints other than bounds.

    Where no step satisfies constraints that are violated, the solution that does not increase their violation.
    """
    unit = np.eye(len(low))
    rows = np.concatenate([here.slopes, unit, -unit])
    lower = np.linalg.cholesky(here.square + damping * np.diag(np.diag(here.square)))
    for constraints in (here.constraints, np.minimum(here.constraints, 0.0)):
        found = _least_distance(lower, here.gradient, rows, np.concatenate([-constraints, high, -low]))
        if found is not None:
            step, multipliers = found
            return step, float(multipliers[: len(constraints)].max(initial=0.0))
    return np.zeros(len(low)), 0.0


def _least_distance(
    lower: NDArray[np.floating], gradient: NDArray[np.float64], rows: NDArray[np.float64], room: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Minimiser s of ½ |Lᵀ s|² + g·s under rows · s ≤ room, and the multipliers of the rows; None where no s satisfies
    them."""
    from scipy.optimize import nnls

    # least distance form: minimise |y|, y = Lᵀ s − t, under G y ≥ h
    target = np.linalg.solve(lower, -gradient)
    step = np.linalg.solve(lower.T, target)
    chosen = np.zeros(len(rows), dtype=bool)
    multipliers = np.zeros(len(rows))
    while (beyond := ~chosen & (rows @ step > room + _TOUCH)).any():
        chosen |= beyond
        whitened = np.linalg.solve(lower, rows[chosen].T)
        short = whitened.T @ target - room[chosen]
        wanted = np.append(np.zeros(len(gradient)), 1.0)
        found, residual = nnls(np.vstack([-whitened, short]), wanted, maxiter=50 * len(rows))
        if residual < _IMPOSSIBLE:
            return None
        multipliers[chosen] = found / (1.0 - short @ found)
        step = np.linalg.solve(lower.T, target - whitened @ multipliers[chosen])
    return step, multipliers
