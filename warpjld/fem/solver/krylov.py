"""Krylov methods with an explicit status: conjugate gradients, and flexible GMRES (Saad 1993)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.arrays import Array, dot, norm

__all__ = ["Iteration", "SolveStatus", "conjugate_gradients", "minimal_residuals"]

_Operator = Callable[[NDArray[Any]], NDArray[Any]]


class SolveStatus(Enum):
    """How a solve ended; values are messages for the user."""

    CONVERGED = "converged"
    STAGNATED = "the residual stopped falling before the tolerance was reached"
    INDEFINITE = "the stiffness is not positive definite: a body is free, unstable, or an element is inverted"
    NOT_FINITE = "a number became infinite or undefined"
    MAX_ITERATIONS = "the iterations allowed were not enough"
    LIMIT_LOAD = "a limit load: beyond it no stable equilibrium was found"
    INVERTED = "elements were inverted even by the smallest step"
    SLIDING = "slides: friction is not enough to hold it"
    UNHELD = "a body is not constrained"
    BLOCKED = "bodies overlap where both sides are prescribed"
    PASSED = "bodies would pass through each other, or overlap so far that contact cannot separate them"
    EXHAUSTED = "the linear solves allowed were not enough"
    STOPPED = "stopped as asked"


@dataclass(frozen=True, eq=False)
class Iteration:
    """Result of an iterative solve.

    Attributes:
        x: Solution, shape (n,).
        status: How it ended.
        iterations: Number of iterations.
        residual: True residual |b − A x| / |b|, recomputed at the end in the type of ``x``.
        history: Recursive residual after each iteration.
    """

    x: NDArray[Any]
    status: SolveStatus
    iterations: int
    residual: float
    history: Array


def conjugate_gradients(
    product: _Operator,
    precondition: _Operator,
    b: NDArray[Any],
    *,
    start: NDArray[Any] | None = None,
    tolerance: float = 1e-8,
    iterations: int = 2000,
    patience: int = 300,
) -> Iteration:
    """Solve A x = b, A symmetric positive definite, to |b − A x| ≤ tolerance |b|.

    The flexible (Polak–Ribière) variant: the preconditioner may be rounded to float32. When the recursive residual
    converges the true one is computed, and the iteration restarts from it if they differ.

    Args:
        product: Function x → A x.
        precondition: Function r → M r.
        b: Right-hand side, shape (n,).
        start: Initial guess, zero by default.
        tolerance: Tolerance of the residual, relative to |b|.
        iterations: Largest number of iterations.
        patience: Number of iterations without a smaller residual that counts as stagnation.
    """
    size = norm(b)
    x = np.zeros_like(b) if start is None else start.copy()
    if not np.isfinite(size):
        return Iteration(x, SolveStatus.NOT_FINITE, 0, float("nan"), np.empty(0))
    if size == 0.0:
        return Iteration(np.zeros_like(b), SolveStatus.CONVERGED, 0, 0.0, np.empty(0))
    r = b - product(x) if start is not None else b.copy()
    history: list[float] = []
    status = _cg(product, precondition, b, x, r, size, history, tolerance, iterations, patience)
    true = norm(b - product(x)) / size
    return Iteration(x, status, len(history), true, np.array(history))


def _cg(
    product: _Operator,
    precondition: _Operator,
    b: NDArray[Any],
    x: NDArray[Any],
    r: NDArray[Any],
    size: float,
    history: list[float],
    tolerance: float,
    iterations: int,
    patience: int,
) -> SolveStatus:
    """Iterations from x with the residual r, both overwritten; ``history`` is appended."""
    best, since, last_true, fresh = np.inf, 0, np.inf, True
    p = q = r
    alpha = rz = 0.0
    now = norm(r) / size
    while True:
        if not np.isfinite(now):
            return SolveStatus.NOT_FINITE
        if now <= tolerance:
            r = b - product(x)
            now = norm(r) / size
            if now <= tolerance * 1.0000001:
                return SolveStatus.CONVERGED
            if now > 0.5 * last_true:
                return SolveStatus.STAGNATED
            last_true, fresh = now, True
        if len(history) >= iterations:
            return SolveStatus.MAX_ITERATIONS
        best, since = (now, 0) if now < 0.999 * best else (best, since + 1)
        if since > patience:
            return SolveStatus.STAGNATED
        z = precondition(r)
        before, rz = rz, dot(r, z)
        if not rz > 0.0:
            return SolveStatus.INDEFINITE if np.isfinite(rz) else SolveStatus.NOT_FINITE
        if fresh:
            p, fresh = z.copy(), False
        else:
            p *= p.dtype.type(-alpha * dot(z, q) / before)
            p += z
        q = product(p)
        curvature = dot(p, q)
        if not curvature > 0.0:
            return SolveStatus.INDEFINITE if np.isfinite(curvature) else SolveStatus.NOT_FINITE
        alpha = dot(r, p) / curvature
        x += x.dtype.type(alpha) * p
        r -= r.dtype.type(alpha) * q
        now = norm(r) / size
        history.append(now)


_Vector = Array
_RESTART = 80  # basis vectors of GMRES before a restart


def minimal_residuals(
    product: Callable[[_Vector], _Vector],
    precondition: Callable[[_Vector], _Vector],
    b: _Vector,
    *,
    tolerance: float = 1e-8,
    iterations: int = 400,
) -> Iteration:
    """Solve A x = b by flexible GMRES.

    Args:
        product: Function x → A x.
        precondition: Function r → M⁻¹ r; may change between calls (flexible).
        b: Right-hand side, shape (n,).
        tolerance: Tolerance of |b − A x| / |b|.
        iterations: Largest number of iterations.
    """
    x, size = np.zeros_like(b), norm(b)
    history: list[float] = []
    if not np.isfinite(size):
        return Iteration(x, SolveStatus.NOT_FINITE, 0, float("nan"), np.array(history))
    residual, now = b, 1.0
    while size > 0.0 and len(history) < iterations:
        steps = min(_RESTART, iterations - len(history))
        basis, ahead = [residual / norm(residual)], []
        table = np.zeros((steps + 1, steps))
        right = np.zeros(steps + 1)
        right[0] = now
        for k in range(steps):
            ahead.append(precondition(basis[k]))
            new = product(ahead[k])
            for _ in range(2):  # twice is enough (Parlett)
                along = np.array([dot(v, new) for v in basis])
                table[: k + 1, k] += along
                for part, v in zip(along, basis, strict=True):
                    new = new - part * v
            table[k + 1, k] = norm(new)
            weights, *_ = np.linalg.lstsq(table[: k + 2, : k + 1], right[: k + 2], rcond=None)
            left = float(np.linalg.norm(right[: k + 2] - table[: k + 2, : k + 1] @ weights))
            history.append(left)
            if not np.isfinite(left):
                return Iteration(x, SolveStatus.NOT_FINITE, len(history), left, np.array(history))
            if left <= tolerance or table[k + 1, k] <= 1e-14 * table[0, 0]:
                break
            basis.append(new / table[k + 1, k])
        for weight, direction in zip(weights, ahead, strict=True):
            x = x + size * weight * direction
        residual = b - product(x)
        before, now = now, norm(residual) / size
        if now <= 2.0 * tolerance:
            return Iteration(x, SolveStatus.CONVERGED, len(history), now, np.array(history))
        if now > 0.9 * before:
            return Iteration(x, SolveStatus.STAGNATED, len(history), now, np.array(history))
    status = SolveStatus.CONVERGED if now <= tolerance or size == 0.0 else SolveStatus.MAX_ITERATIONS
    return Iteration(x, status, len(history), 0.0 if size == 0.0 else now, np.array(history))
