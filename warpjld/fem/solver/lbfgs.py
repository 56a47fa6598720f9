"""Minimising a smooth function of very many variables (limited-memory BFGS)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.solver.block_matrix import dot, norm

__all__ = ["minimise"]

_MEMORY = 10
_SHORTEST = 1e-10


def minimise(cost: Callable[[Array], tuple[float, Array]], start: Array, *, rounds: int, first_step: float) -> Array:
    """A lower point of ``cost``, after at most so many rounds (Nocedal & Wright, algorithm 7.5, Armijo steps).

    SciPy's does the same through BLAS, whose threads wait for one another at every dot product of these sizes.

    Args:
        cost: Value and gradient at a point.
        start: First point, shape (n,).
        rounds: Steps at most.
        first_step: Largest change of one variable in the first step.
    """
    x = start.copy()
    value, slope = cost(x)
    slope = slope.copy()
    pairs: list[tuple[Array, Array, float]] = []
    for _ in range(rounds):
        direction = -slope
        shares = []
        for s, y, rho in reversed(pairs):
            share = rho * dot(s, direction)
            direction -= share * y
            shares.append(share)
        if pairs:
            s, y, rho = pairs[-1]
            direction *= 1.0 / (rho * dot(y, y))
        else:
            direction *= first_step / max(float(np.abs(slope).max()), 1e-300)
        for (s, y, rho), share in zip(pairs, reversed(shares), strict=True):
            direction += (share - rho * dot(y, direction)) * s
        descent = dot(direction, slope)
        if not descent < 0.0:
            if not pairs:
                break
            pairs.clear()
            continue
        length = 1.0
        while True:
            there = x + length * direction
            new, new_slope = cost(there)
            if new <= value + 1e-4 * length * descent:
                break
            length *= 0.5
            if length < _SHORTEST:
                return x
        s, y = there - x, new_slope - slope
        curvature = dot(s, y)
        if curvature > 1e-10 * norm(s) * norm(y):
            pairs.append((s, y, 1.0 / curvature))
            if len(pairs) > _MEMORY:
                pairs.pop(0)
        x, value, slope = there, new, new_slope.copy()
    return x
