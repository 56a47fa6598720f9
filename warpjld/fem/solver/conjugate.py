"""Conjugate gradients that say how they ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.arrays import Array
from warpjld.fem.solver.block_matrix import dot, norm

__all__ = ["Iteration", "Status", "conjugate_gradients"]

_Operator = Callable[[NDArray[Any]], NDArray[Any]]


class Status(Enum):
    """How a solve ended; the value is the message for people."""

    CONVERGED = "converged"
    STAGNATED = "the residual stopped falling before the tolerance was reached"
    INDEFINITE = "the stiffness is not positive definite: a body is free, unstable, or an element is turned inside out"
    NOT_FINITE = "a number became infinite or undefined"
    MAX_ITERATIONS = "the iterations allowed were not enough"
    INVERTED = "elements were turned inside out, however small the step"
    SLIDING = "slides: friction is not enough to hold it"
    UNHELD = "nothing holds it"
    BLOCKED = "bodies overlap where all that meets is prescribed"
    STOPPED = "stopped as asked"


@dataclass(frozen=True, eq=False)
class Iteration:
    """Result of an iterative solve.

    Attributes:
        x: Solution, shape (n,).
        status: How it ended.
        iterations: Iterations done.
        residual: True residual |b − A x| / |b|, computed afresh at the end in the type of ``x``.
        history: Recursive residual after each iteration.
    """

    x: NDArray[Any]
    status: Status
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

    The flexible (Polak–Ribière) form: the preconditioner may be rounded to float32. When the recursive residual claims
    convergence the true one is computed, and the iteration starts again from it where they differ.

    Args:
        product: x → A x.
        precondition: r → M r.
        b: Right side, shape (n,).
        start: First guess, zero by default.
        tolerance: Relative to |b|.
        iterations: At most so many.
        patience: Iterations without a lower residual after which it has stagnated.
    """
    history: list[float] = []
    size = norm(b)
    x = np.zeros_like(b) if start is None else start.copy()
    if not np.isfinite(size):
        return Iteration(x, Status.NOT_FINITE, 0, float("nan"), np.array(history))
    if size == 0.0:
        return Iteration(np.zeros_like(b), Status.CONVERGED, 0, 0.0, np.array(history))
    r = b - product(x) if start is not None else b.copy()
    status = Status.MAX_ITERATIONS
    done, best, since, last_true = 0, np.inf, 0, np.inf
    fresh = True
    p = q = r
    alpha = rz = 0.0
    now = norm(r) / size
    while True:
        if not np.isfinite(now):
            status = Status.NOT_FINITE
            break
        if now <= tolerance:
            r = b - product(x)
            now = norm(r) / size
            if now <= tolerance * 1.0000001:
                status = Status.CONVERGED
                break
            if now > 0.5 * last_true:
                status = Status.STAGNATED
                break
            last_true, fresh = now, True
        if done >= iterations:
            break
        if now < 0.999 * best:
            best, since = now, 0
        else:
            since += 1
            if since > patience:
                status = Status.STAGNATED
                break
        z = precondition(r)
        before, rz = rz, dot(r, z)
        if not rz > 0.0:
            status = Status.NOT_FINITE if not np.isfinite(rz) else Status.INDEFINITE
            break
        if fresh:
            p = z.copy()
            fresh = False
        else:
            beta = -alpha * dot(z, q) / before
            p *= p.dtype.type(beta)
            p += z
        q = product(p)
        curvature = dot(p, q)
        if not curvature > 0.0:
            status = Status.NOT_FINITE if not np.isfinite(curvature) else Status.INDEFINITE
            break
        alpha = dot(r, p) / curvature
        x += x.dtype.type(alpha) * p
        r -= r.dtype.type(alpha) * q
        done += 1
        now = norm(r) / size
        history.append(now)
    true = norm(b - product(x)) / size
    return Iteration(x, status, done, true, np.array(history))
