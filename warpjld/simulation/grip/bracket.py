"""Bracketed Newton search for the grip at which an increasing quantity reaches a target; used by all grip searches.

Forces of digits increase ever faster from the first contact on. Outside a bracket, slopes at one or two grips give the
stiffening (``warpjld.fem.hand.stiffening``) and thus the target; inside a bracket inverse cubic Hermite interpolation
with values and slopes at both ends is used, applied to the square root of the value, which is nearly linear in the
grip. Without slopes the secant is used; without contact steps grow geometrically. No step leaves the bracket, and a
step to a grip without equilibrium is bisected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.hand.stiffening import ForceSlope, way_to

__all__ = ["Bracket", "checked_step"]

_MARGIN = 0.03
"""Fraction of the bracket at either end in which no grip is tried."""
_FARTHEST = 12.0
"""Longest step outside a bracket, over the default step."""
_SHORTEST = 0.01
"""Shortest step outside a bracket, over the default step."""
_KEPT, _LONGER = 0.25, 2.0
"""Share of the rise that a slope promised below which slopes are not relied on, and the next step over the last one."""
_POWER = 2.0
"""Assumed exponent of the value's growth since first contact, until two slopes are known."""
_SLOW = 0.6
"""Remaining fraction of a bracket above which the next step bisects it."""


@dataclass(frozen=True)
class _Point:
    """A tried grip: its value, and the derivative of the value with respect to the grip; None if not known."""

    grip: float
    value: float
    slope: float | None

    @property
    def root(self) -> float:
        """Square root of the value."""
        return math.sqrt(max(self.value, 0.0))

    @property
    def ahead(self) -> float | None:
        """Derivative of the grip with respect to the root of the value; None if not known."""
        if self.slope is None or not self.slope > 0.0 or not self.value > 0.0:
            return None
        return 2.0 * self.root / self.slope


class Bracket:
    """Search for the grip at which an increasing value reaches a target.

    Args:
        low, high: Range of grips.
        target: Target of the value.
        step: First step above ``low`` as long as nothing is known.
    """

    def __init__(self, low: float, high: float, target: float, step: float) -> None:
        self.low, self.high, self.target = low, high, target
        self._step = step
        self._below: list[_Point] = []
        self._above: list[_Point] = []
        self._lost: list[float] = []
        self._width = math.inf

    def note(self, grip: float, value: float, slope: float | None, *, enough: bool) -> None:
        """Record a tried grip; ``enough`` tells whether its value reaches the target, by the caller's criterion.

        A result that contradicts earlier ones (possible where digits push one another) replaces them.
        """
        point = _Point(grip, value, slope)
        if enough:
            self._below = [one for one in self._below if one.grip < grip]
            self._above.append(point)
        else:
            self._above = [one for one in self._above if one.grip > grip]
            self._below.append(point)

    def distrust(self) -> None:
        """Discard all values and slopes, which measured another quantity; the grips remain as bounds."""
        self._below = [_Point(one.grip, math.nan, None) for one in self._below]
        self._above = [_Point(one.grip, math.nan, None) for one in self._above]

    def lose(self, grip: float) -> None:
        """Record a grip at which no equilibrium was found."""
        self._lost.append(grip)

    @property
    def below(self) -> _Point | None:
        """Largest grip that was not enough."""
        return max(self._below, key=lambda one: one.grip, default=None)

    @property
    def above(self) -> _Point | None:
        """Smallest grip that was enough."""
        return min(self._above, key=lambda one: one.grip, default=None)

    @property
    def width(self) -> float:
        """Width of the bracket; infinite as long as an end is open."""
        below, above = self.below, self.above
        return math.inf if below is None or above is None else above.grip - below.grip

    def next(self) -> float | None:
        """Next grip to try; None if the range or the bracket is exhausted."""
        below, above = self.below, self.above
        floor = self.low if below is None else below.grip
        top = self.high if above is None else above.grip
        if not top > floor:
            return None
        lost = [one for one in self._lost if floor < one <= top]
        proposed = self._predicted(below, above)
        width = self.width
        if above is not None and below is not None:
            if width > _SLOW * self._width:  # the last step reduced the bracket too little
                proposed = 0.5 * (floor + top)
            self._width = width
            room = _MARGIN * (top - floor)
            proposed = float(np.clip(proposed, floor + room, top - room))
        elif above is None:
            proposed = min(proposed, self.high)
        else:
            proposed = max(proposed, self.low)
        if lost and proposed >= min(lost):
            proposed = 0.5 * (floor + min(lost))
        return proposed

    def _predicted(self, below: _Point | None, above: _Point | None) -> float:
        """Grip at which the target is predicted."""
        aim = math.sqrt(self.target)
        if below is not None and above is not None:
            return _between(self._sloped(below, self._below), self._sloped(above, self._above), aim)
        known = below if above is None else above
        if known is None:
            return self.low
        if known.ahead is not None:
            far = self._distance(known, self._below if above is None else self._above)
            if above is None:
                far = max(far, self._overdue(known))
                return known.grip + min(max(far, _SHORTEST * self._step), _FARTHEST * self._step)
            return known.grip + min(far, -_SHORTEST * self._step)
        return self._inward(known) if below is None else self._outward(known)

    def _overdue(self, last: _Point) -> float:
        """Twice the last step, if the value rose in it by much less than the slope at its start promised; else 0.

        An object that rides along turns or slides away from a digit meanwhile, which no derivative tells: slopes alone
        would lead to one small step after the other.
        """
        others = [one for one in self._below if one.grip < last.grip and one.slope is not None]
        before = max(others, key=lambda one: one.grip, default=None)
        if before is None or before.slope is None:
            return 0.0
        step = last.grip - before.grip
        return _LONGER * step if last.value - before.value < _KEPT * before.slope * step else 0.0

    def _distance(self, known: _Point, side: list[_Point]) -> float:
        """Distance to the target extrapolated from a point and its nearest neighbour on the same side, if any."""
        others = [one for one in side if one.grip != known.grip and one.ahead is not None]
        near = min(others, key=lambda one: abs(one.grip - known.grip), default=None)
        here = ForceSlope(known.value, known.slope or math.nan)
        there = None if near is None else ForceSlope(near.value, near.slope or math.nan)
        return way_to(self.target, here, there, _POWER)

    @staticmethod
    def _sloped(end: _Point, side: list[_Point]) -> _Point:
        """An end of the bracket; without a slope, with the secant slope to its nearest neighbour on the same side."""
        others = [one for one in side if one.grip != end.grip and one.root > 0.0]
        if end.ahead is not None or not others:
            return end
        near = min(others, key=lambda one: abs(one.grip - end.grip))
        rise = (near.root - end.root) / (near.grip - end.grip)
        return replace(end, slope=2.0 * end.root * rise) if rise > 0.0 else end

    def _inward(self, first: _Point) -> float:
        """A smaller grip, by steps that double, or along the secant if two points increase."""
        step, self._step = self._step, 2.0 * self._step
        sloped = self._sloped(first, self._above)
        if sloped.ahead is None:
            return first.grip - step
        return first.grip - max((first.root - math.sqrt(self.target)) * sloped.ahead, _SHORTEST * step)

    def _outward(self, last: _Point) -> float:
        """A larger grip, by steps that double, or along the secant if two points increase."""
        others = [one for one in self._below if one.grip < last.grip]
        step, self._step = self._step, 2.0 * self._step
        before = max(others, key=lambda one: one.grip, default=None)
        if before is not None and last.root > before.root:
            line = (last.grip - before.grip) / (last.root - before.root)
            return last.grip + min(max((math.sqrt(self.target) - last.root) * line, _SHORTEST * step), step)
        return last.grip + step


def _between(below: _Point, above: _Point, aim: float) -> float:
    """Inverse Hermite interpolation of the root in a bracket; its middle where values do not increase."""
    rise = above.root - below.root
    if not (math.isfinite(rise) and rise > 0.0 and 0.0 < below.root < aim <= above.root):
        nearest = [one for one in (below, above) if one.ahead is not None and math.isfinite(one.root)]
        guesses = [one.grip + (aim - one.root) * (one.ahead or 0.0) for one in nearest]
        inside = [guess for guess in guesses if below.grip < guess < above.grip]
        return inside[-1] if inside else 0.5 * (below.grip + above.grip)  # the grip of first contact is not known
    width, t = above.grip - below.grip, (aim - below.root) / rise
    chord = width / rise
    # slopes of at most three times the secant keep the cubic monotone (Fritsch and Carlson 1980)
    first, last = (chord if one.ahead is None else min(one.ahead, 3.0 * chord) for one in (below, above))
    return below.grip + width * t * t * (3.0 - 2.0 * t) + rise * t * (1.0 - t) * (first * (1.0 - t) - last * t)


def checked_step(low: float, high: float, start: float | None) -> float:
    """First step above ``low``: ``start``, or a sixteenth of the range.

    Raises:
        InputError: An empty range, or a step outside it.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise InputError(f"grip: want low < high, got {low} and {high}")
    step = (high - low) / 16.0 if start is None else float(start)
    if not 0.0 < step <= high - low:
        raise InputError(f"grip: want a first step above 0 within the range, got {step}")
    return step
