"""Line search along a Newton step: by elements' Jacobians, by the work of what drives on, by the residual."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.fem.arrays import Array, Mask, dot, norm
from warpjld.fem.contact.law.contact_state import ActiveSet
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.newton_state import NewtonState

__all__ = ["length_by_residual", "length_by_work", "length_upright"]

_TRIALS = 8
_OVERSHOT = 0.5
"""Pull back over what drives here, from which on a step was too long."""
_BALANCED = 0.3
"""The same where the search ends."""
_LEAST = 1e-6
_FLATTEST = 0.2
"""Part of their Jacobian determinants that elements keep in a step."""


def length_upright(elastic: Elastic, u: Array, move: Array, lowest: Array) -> float:
    """The longest of 1, ½, ¼ … that flattens no element to less than a part of what it is, 0 where none does not.

    Nearly inside out, flesh answers with forces that no later step finds its way back from.

    Args:
        elastic: The bodies.
        u: Displacement [m], shape (3N,).
        move: From there, shape (3N,).
        lowest: Lowest Jacobian determinants of the elements there, shape (E,).
    """
    length = 1.0
    for _ in range(_TRIALS):
        if elastic.upright(u + length * move, _FLATTEST * lowest):
            return length
        length *= 0.5
    return 0.0


def length_by_work(state: NewtonState, move: Array, most: float, watched: Mask) -> float:
    """``most``; or, where forces on the watched degrees of freedom (3N,) pull back there harder than half of what
    drives here, to where they balance along the way. A contact that opens and closes in turn settles so, and what
    falls freely stops where it first touches.
    """
    if not watched.any():
        return most
    along = np.where(watched, move, 0.0)

    def pull(part: float) -> float:
        """What drives on after part of the way; contact as the linear model has it."""
        pushed = state.system.nodal(state.contact.points, state.predicted(part * move))
        return dot(state.pull(state.u + part * move) + pushed, along)

    driving, there = dot(state.residual, along), pull(most)
    if not (driving > 0.0 and there < -_OVERSHOT * driving):
        return most
    return max(_balance(pull, most, driving, there), _LEAST)


def length_by_residual(state: NewtonState, move: Array, most: float) -> float:
    """How far to go, ``most`` at most, for forces to balance better than here: where points come and go in turn, or
    K is indefinite, the work along the way does not tell.
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
    """Part of the way up to ``end`` at which what drives on changes its sign, about (Illinois' regula falsi)."""
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
