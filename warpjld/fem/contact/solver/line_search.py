"""Line searches along a Newton step: by Jacobian determinants, by the work of the residual, by its norm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.fem.arrays import Array, Mask, dot, norm
from warpjld.fem.contact.law.contact_state import ActiveSet
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.newton_state import NewtonState

__all__ = ["length_by_residual", "length_by_work", "length_upright"]

_TRIALS = 8
"""Most trial lengths of a line search."""
_OVERSHOT = 0.5
"""Negative slope at the end over the slope at the start of a step, above which the step is too long."""
_BALANCED = 0.3
"""Slope over that at the start, in absolute value, at which the search ends."""
_LEAST = 1e-6
"""Shortest step length."""
_FLATTEST = 0.2
"""Fraction of their Jacobian determinants that elements keep in a step."""


def length_upright(elastic: Elastic, u: Array, move: Array, lowest: Array) -> float:
    """Longest step of 1, ½, ¼ … in which every element keeps ``_FLATTEST`` of its Jacobian determinant; 0 if none does.

    Nearly inverted elements cause forces from which Newton's method does not recover.

    Args:
        elastic: The bodies.
        u: Displacement [m], shape (3N,).
        move: Newton step [m], shape (3N,).
        lowest: Lowest Jacobian determinants of the elements at u, shape (E,).
    """
    length = 1.0
    for _ in range(_TRIALS):
        if elastic.upright(u + length * move, _FLATTEST * lowest):
            return length
        length *= 0.5
    return 0.0


def length_by_work(state: NewtonState, move: Array, most: float, watched: Mask) -> float:
    """Step length at which the residual does no work along the move (3N,), if the step ``most`` overshoots it.

    Only the watched degrees of freedom (3N,) count. This settles contacts that open and close in turn, and stops freely
    falling bodies at their first contact.
    """
    if not watched.any():
        return most
    along = np.where(watched, move, 0.0)

    def pull(part: float) -> float:
        """Work rate of the residual at a step length; contact by its linearised kinematics."""
        pushed = state.system.nodal(state.contact.points, state.predicted(part * move))
        return dot(state.pull(state.u + part * move) + pushed, along)

    driving, there = dot(state.residual, along), pull(most)
    if not (driving > 0.0 and there < -_OVERSHOT * driving):
        return most
    return max(_balance(pull, most, driving, there), _LEAST)


def length_by_residual(state: NewtonState, move: Array, most: float) -> float:
    """Step length up to ``most`` at which the norm of the residual decreases, or the best one tried.

    Used with a non-symmetric tangent, for which the work along the move is no measure.
    """
    now = norm(state.residual)
    length, best = most, (np.inf, most)
    for _ in range(_TRIALS):
        there = state.u + length * move
        contact = state.forces(state.points_at(there), there, ActiveSet.TRIAL, coupled=state.contact.coupled)
        left = norm(np.where(state.free, state.pull(there) + contact.forces, 0.0))
        if left < (1.0 - 1e-4 * length) * now:
            return length
        if left < best[0]:
            best = (left, length)
        length *= 0.5
    return best[1]


def _balance(pull: Callable[[float], float], end: float, at_start: float, at_end: float) -> float:
    """Approximate step length up to ``end`` at which the slope changes sign, by regula falsi (Illinois variant)."""
    low, high, driving, against = 0.0, end, at_start, at_end
    for _ in range(_TRIALS):
        margin = 0.02 * (high - low)
        line = (low * against - high * driving) / (against - driving)
        part = float(np.clip(line, low + margin, high - margin))
        there = pull(part)
        if abs(there) <= _BALANCED * at_start:
            return part
        if there > 0.0:
            against *= 0.5 if low > 0.0 else 1.0
            low, driving = part, there
        else:
            driving *= 0.5 if high < end else 1.0
            high, against = part, there
    return low or high
