"""Fit of the plan's scales to a given length and breadth, which are measured on the implicit surface."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from warpjld.hand.design import BREADTH, LENGTH
from warpjld.hand.flesh import PlannedFlesh
from warpjld.hand.plan import Plan, plan_hand

__all__ = ["fit_plan", "measure"]

Array = NDArray[np.float64]

_ROUNDS = 3  # iterations of measuring and scaling
_HEADS = 0.42  # distance from the wrist, in hand lengths, where breadth is measured (heads of the metacarpals)


def fit_plan(length: float, breadth: float, proportions: Mapping[str, tuple[float, float]]) -> Plan:
    """The plan of a hand of this length and breadth [mm]; ``proportions`` as of ``plan_hand``."""
    along, across = length / LENGTH, breadth / BREADTH
    for _ in range(_ROUNDS):
        plan = plan_hand(along, across, proportions)
        long, broad = measure(PlannedFlesh(plan), length)
        along, across = along * length / long, across * breadth / broad
    return plan_hand(along, across, proportions)


def measure(flesh: PlannedFlesh, length: float) -> tuple[float, float]:
    """Length from the wrist's crease to the tip of the middle finger, and breadth across the palm [mm].

    Args:
        flesh: The hand's implicit surface.
        length: Nominal length, which determines where breadth is measured [mm].
    """
    plan = flesh.plan
    tip = plan.digits["middle"].joints[3]
    reach = 6.0 * float(plan.stretch[0])
    grid = np.stack(np.meshgrid(*[np.linspace(-reach, reach, 17)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = np.column_stack([tip[0] + grid[:, 0], tip[1] + grid[:, 1], np.full(len(grid), tip[2])])
    inside = inside[flesh(inside) < 0.0]
    far = _cross(flesh, inside, np.array([0.0, 0.0, -1.0]), 30.0 * float(plan.stretch[2]))
    heights = np.linspace(-14.0, 12.0, 27) * float(plan.stretch[1])
    middle = np.column_stack([np.zeros((len(heights), 1)), heights, np.full(len(heights), -_HEADS * length)])
    middle = middle[flesh(middle) < 0.0]
    out = 60.0 * float(plan.stretch[0])
    radial = _cross(flesh, middle, np.array([1.0, 0.0, 0.0]), out).max()
    ulnar = _cross(flesh, middle, np.array([-1.0, 0.0, 0.0]), out).max()
    return float((far - inside[:, 2]).max()), float(radial + ulnar)


def _cross(flesh: PlannedFlesh, start: Array, direction: Array, reach: float) -> Array:
    """Distance [mm] from inner points along a direction to the first crossing of the surface, shape (n,)."""
    steps = np.arange(1.0, reach, 1.5)
    marched = start[:, None, :] + steps[:, None] * direction
    outside = flesh(marched.reshape(-1, 3)).reshape(len(start), len(steps)) > 0.0
    first = np.where(outside.any(axis=1), outside.argmax(axis=1), len(steps) - 1)
    high = steps[first]
    low = np.where(first > 0, steps[first - 1], 0.0)
    for _ in range(20):
        middle = 0.5 * (low + high)
        outside = flesh(start + middle[:, None] * direction) > 0.0
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    return 0.5 * (low + high)
