"""Generalised minimal residuals, preconditioned from the right, for matrices that are not symmetric (Saad 1993)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.solver.block_matrix import norm
from warpjld.fem.solver.conjugate import Iteration, Status

__all__ = ["minimal_residuals"]

_Vector = Array
_RESTART = 80


def minimal_residuals(
    product: Callable[[_Vector], _Vector],
    precondition: Callable[[_Vector], _Vector],
    b: _Vector,
    *,
    tolerance: float = 1e-8,
    iterations: int = 400,
) -> Iteration:
    """Solve A x = b.

    Args:
        product: x → A x.
        precondition: r → M⁻¹ r; need not be the same map every time (flexible).
        b: Right side, shape (n,).
        tolerance: Of |b − A x| / |b|.
        iterations: At most.
    """
    x, size = np.zeros_like(b), norm(b)
    history: list[float] = []
    if not np.isfinite(size):
        return Iteration(x, Status.NOT_FINITE, 0, float("nan"), np.array(history))
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
                along = np.array([v @ new for v in basis])
                table[: k + 1, k] += along
                for part, v in zip(along, basis, strict=True):
                    new = new - part * v
            table[k + 1, k] = norm(new)
            weights, *_ = np.linalg.lstsq(table[: k + 2, : k + 1], right[: k + 2], rcond=None)
            left = float(np.linalg.norm(right[: k + 2] - table[: k + 2, : k + 1] @ weights))
            history.append(left)
            if not np.isfinite(left):
                return Iteration(x, Status.NOT_FINITE, len(history), left, np.array(history))
            if left <= tolerance or table[k + 1, k] <= 1e-14 * table[0, 0]:
                break
            basis.append(new / table[k + 1, k])
        for weight, direction in zip(weights, ahead, strict=True):
            x = x + size * weight * direction
        residual = b - product(x)
        before, now = now, norm(residual) / size
        if now <= 2.0 * tolerance:
            return Iteration(x, Status.CONVERGED, len(history), now, np.array(history))
        if now > 0.9 * before:
            return Iteration(x, Status.STAGNATED, len(history), now, np.array(history))
    status = Status.CONVERGED if now <= tolerance or size == 0.0 else Status.MAX_ITERATIONS
    return Iteration(x, status, len(history), 0.0 if size == 0.0 else now, np.array(history))
