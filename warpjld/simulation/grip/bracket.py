"""The one search that grips are found by: Newton's method on what rises with the grip, guarded by a bracket.

What digits press with rises ever faster from the first touch on. Slopes at one or two grips tell how it stiffens
(``warpjld.fem.hand.stiffening``), and so where the target lies; inside a bracket the cubic does that has values and
slopes of both ends (inverse Hermite interpolation, of the value's root, which is nearly straight). Where no slope is
known, the chord does; where nothing has been touched, steps grow. No step leaves the bracket, and one that lost an
equilibrium is gone half of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.hand.stiffening import ForceSlope, way_to

__all__ = ["Bracket", "checked_step"]

_MARGIN = 0.03
"""Part of a bracket, at either end, that is left alone."""
_FARTHEST = 12.0
"""How many times the last step outwards a Newton step may be."""
_SHORTEST = 0.01
"""The same at least."""
_POWER = 2.0
"""Of the way since the first touch that a value rises with, before two slopes tell."""
_SLOW = 0.6
"""Part of its bracket that a step should leave at most, or the next halves it."""


@dataclass(frozen=True)
class _Point:
    """A grip that was tried: what it measures, and the slope of that by the grip, where known."""

    grip: float
    value: float
    slope: float | None

    @property
    def root(self) -> float:
        return math.sqrt(max(self.value, 0.0))

    @property
    def ahead(self) -> float | None:
        """dgrip / droot."""
        if self.slope is None or not self.slope > 0.0 or not self.value > 0.0:
            return None
        return 2.0 * self.root / self.slope


class Bracket:
    """Where to look for the grip at which something that rises comes to a target.

    Args:
        low, high: Range of grips.
        target: Value that is wanted.
        step: First step above ``low``, where nothing is known.
    """

    def __init__(self, low: float, high: float, target: float, step: float) -> None:
        self.low, self.high, self.target = low, high, target
        self._step = step
        self._below: list[_Point] = []
        self._above: list[_Point] = []
        self._lost: list[float] = []
        self._width = math.inf

    def note(self, grip: float, value: float, slope: float | None, *, enough: bool) -> None:
        """A grip was tried; whether its value is enough is for the caller to say. One that contradicts what was known
        before (digits that push one another do) is believed."""
        point = _Point(grip, value, slope)
        if enough:
            self._below = [one for one in self._below if one.grip < grip]
            self._above.append(point)
        else:
            self._above = [one for one in self._above if one.grip > grip]
            self._below.append(point)

    def distrust(self) -> None:
        """What was measured until now was something else: grips stay as bounds, without values and slopes."""
        self._below = [_Point(one.grip, math.nan, None) for one in self._below]
        self._above = [_Point(one.grip, math.nan, None) for one in self._above]

    def lose(self, grip: float) -> None:
        """A grip at which no equilibrium was found."""
        self._lost.append(grip)

    @property
    def below(self) -> _Point | None:
        """The firmest that was not enough."""
        return max(self._below, key=lambda one: one.grip, default=None)

    @property
    def above(self) -> _Point | None:
        """The gentlest that was enough."""
        return min(self._above, key=lambda one: one.grip, default=None)

    @property
    def width(self) -> float:
        """Of the bracket; infinite where it is open."""
        below, above = self.below, self.above
        return math.inf if below is None or above is None else above.grip - below.grip

    def next(self) -> float | None:
        """The grip to try; None where there is none left: the range is at its end, or lost on both sides."""
        below, above = self.below, self.above
        floor = self.low if below is None else below.grip
        top = self.high if above is None else above.grip
        if not top > floor:
            return None
        lost = [one for one in self._lost if floor < one <= top]
        wished = self._wished(below, above)
        narrow = self.width
        if above is not None and below is not None:
            if narrow > _SLOW * self._width:  # the last step left most of the bracket
                wished = 0.5 * (floor + top)
            self._width = narrow
            room = _MARGIN * (top - floor)
            wished = float(np.clip(wished, floor + room, top - room))
        elif above is None:
            wished = min(wished, self.high)
        else:
            wished = max(wished, self.low)
        if lost and wished >= min(lost):
            wished = 0.5 * (floor + min(lost))
        return wished

    def _wished(self, below: _Point | None, above: _Point | None) -> float:
        """Where the value is foreseen to be the target."""
        aim = math.sqrt(self.target)
        if below is not None and above is not None:
            return _between(self._sloped(below, self._below), self._sloped(above, self._above), aim)
        known = below if above is None else above
        if known is None:
            return self.low
        if known.ahead is not None:
            far = self._way(known, self._below if above is None else self._above)
            if above is None:
                return known.grip + min(max(far, _SHORTEST * self._step), _FARTHEST * self._step)
            return known.grip + min(far, -_SHORTEST * self._step)
        return self._inward(known) if below is None else self._outward(known)

    def _way(self, known: _Point, side: list[_Point]) -> float:
        """How far it is to the target from one point, and the next one on its side, if that is known."""
        others = [one for one in side if one.grip != known.grip and one.ahead is not None]
        near = min(others, key=lambda one: abs(one.grip - known.grip), default=None)
        here = ForceSlope(known.value, known.slope or math.nan)
        there = None if near is None else ForceSlope(near.value, near.slope or math.nan)
        return way_to(self.target, here, there, _POWER)

    @staticmethod
    def _sloped(end: _Point, side: list[_Point]) -> _Point:
        """An end of the bracket with a slope from the next point on its side, where it has none of its own."""
        others = [one for one in side if one.grip != end.grip and one.root > 0.0]
        if end.ahead is not None or not others:
            return end
        near = min(others, key=lambda one: abs(one.grip - end.grip))
        rise = (near.root - end.root) / (near.grip - end.grip)
        return replace(end, slope=2.0 * end.root * rise) if rise > 0.0 else end

    def _inward(self, first: _Point) -> float:
        """Gentler by a longer step each time; along the chord where two points rise."""
        step, self._step = self._step, 2.0 * self._step
        sloped = self._sloped(first, self._above)
        if sloped.ahead is None:
            return first.grip - step
        return first.grip - max((first.root - math.sqrt(self.target)) * sloped.ahead, _SHORTEST * step)

    def _outward(self, last: _Point) -> float:
        """Farther on by a longer step each time; along the chord where two points rise."""
        others = [one for one in self._below if one.grip < last.grip]
        step, self._step = self._step, 2.0 * self._step
        before = max(others, key=lambda one: one.grip, default=None)
        if before is not None and last.root > before.root:
            line = (last.grip - before.grip) / (last.root - before.root)
            return last.grip + min(max((math.sqrt(self.target) - last.root) * line, _SHORTEST * step), _FARTHEST * step)
        return last.grip + step


def _between(below: _Point, above: _Point, aim: float) -> float:
    """Inside a bracket, by what is known at its ends; its middle where that does not rise."""
    rise = above.root - below.root
    if not (math.isfinite(rise) and rise > 0.0 and 0.0 < below.root < aim <= above.root):
        nearest = [one for one in (below, above) if one.ahead is not None and math.isfinite(one.root)]
        guesses = [one.grip + (aim - one.root) * (one.ahead or 0.0) for one in nearest]
        inside = [guess for guess in guesses if below.grip < guess < above.grip]
        return inside[-1] if inside else 0.5 * (below.grip + above.grip)  # where touch begins is not known
    width, share = above.grip - below.grip, (aim - below.root) / rise
    chord = width / rise
    first, last = (chord if one.ahead is None else min(one.ahead, 3.0 * chord) for one in (below, above))
    t = share
    return below.grip + width * t * t * (3.0 - 2.0 * t) + rise * t * (1.0 - t) * (first * (1.0 - t) - last * t)


def checked_step(low: float, high: float, start: float | None) -> float:
    """The first step above ``low``: as given, or a sixteenth of the range.

    Raises:
        InputError: A range that is none, or a step out of it.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise InputError(f"grip: want low < high, got {low} and {high}")
    step = (high - low) / 16.0 if start is None else float(start)
    if not 0.0 < step <= high - low:
        raise InputError(f"grip: want a first step above 0 within the range, got {step}")
    return step
