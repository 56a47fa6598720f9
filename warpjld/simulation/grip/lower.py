"""Lowering: an object goes down into a hand until the hand bears all of its weight, or is seen not to (R122–R124).

With a force on the object there is no equilibrium beyond what friction bears, and a solver that finds none has not
proved it. With the height of the object's middle prescribed there is one at every height: what its handle bears there
is measured, and that the hand bears no more however deep the object sinks is found and not guessed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.simulation.grip.search import TrialOutcome
from warpjld.simulation.grip.shared_weight import SharedWeight

__all__ = ["Lowering", "lower_object"]

_FIRST = 1.0 / 240.0
"""First step down, over the object's height, and how much longer the next may be."""
_LONGER = 2.5
_FAR, _LONGEST = 0.25, 0.25
"""An object that sinks by this share of its height is not held; and part of that way that one step may be long."""
_MOST = 14
"""Steps."""
_PART, _BOUNDS = 0.5, (_FIRST, 0.06)
"""Part of the way that is predicted to take in one step, and bounds of this step, over the object's height."""
_ALMOST = 0.9
"""Part of the way that the tangent foresees to take in the first step."""
_AGAIN = 0.6
"""Part of a step that found no equilibrium that later ones may be long: what fails costs most."""
_SHORTER, _TRIES = 1.0 / 3.0, 3
"""What becomes of a step that finds no equilibrium, and how many are tried."""
_LEFT, _LITTLE = 0.01, 0.001
"""Share of the weight that may be left on the handle when it lets go; and the same where that was too much."""
_SPARE = 0.002
"""Share of the weight that is to be borne beyond all of it where all slides: nothing may be left then."""
_LESS = 0.02
"""Share of the weight that the hand may bear less than it did before the object is said to slip out."""
_TOO_FAR = 0.1
"""Share of the weight that the hand may bear beyond all of it before a step is taken again, and shorter: friction
remembers, and does not let an object rise to where it would have stayed."""
_CLEARLY = 0.9
"""Share of the weight that pressures under it must be able to bear for the descent to go on, if they do not grow."""
_PROBE = 0.05
"""Step once all slides, over ``far``: long enough to see whether more will be borne."""
_ALL = 1.0 - 1e-9


@dataclass(frozen=True, eq=False)
class Lowering:
    """How a descent ended.

    Attributes:
        outcome: How.
        solution: The last equilibrium: where the object is held, the one that nothing but the hand holds.
        instants: All equilibria after the one it began with, in order.
        borne: Largest share of the weight that the hand bore on the way; what it could bear where it holds.
        sunk: How far it sank [m].
        path: How far it had sunk [m] and which share the hand bore, at every equilibrium with the handle.
    """

    outcome: TrialOutcome
    solution: ContactSolution
    instants: tuple[ContactInstant, ...]
    borne: float
    sunk: float
    path: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class _Place:
    """An equilibrium with the handle: shares of the weight, and how far the object has sunk [m]."""

    solution: ContactSolution
    sunk: float
    left: float
    elsewhere: float
    slides: bool
    most: float

    @property
    def borne(self) -> float:
        """By the hand."""
        return 1.0 - self.left - self.elsewhere


def lower_object(
    weight: SharedWeight,
    bare: ContactSolution,
    moved: Callable[[ContactSolution, float], ContactSolution],
    released: Callable[[ContactSolution], ContactSolution],
    *,
    predicted: float | None = None,
    rate: Callable[[ContactSolution], float | None] = lambda after: None,
) -> Lowering:
    """Lower the handle until nothing is left on it, then let go.

    How deep to go, the tangent says (``rate``), then the chord, as friction gives way.

    Args:
        weight: Of the object.
        bare: Equilibrium in which the handle bears what the hand does not.
        moved: Equilibrium after another, with the handle at a height [m].
        released: Equilibrium after another, without the handle.
        predicted: How far it sank at a grip like this one [m].
        rate: How much more of the weight the hand bears per metre that the object sinks from an equilibrium with the
            handle; None where that is not known.
    """
    way = _Way(weight, bare, moved)
    first = _first(weight, way.places[0], predicted, rate)
    step, enough = first * weight.tall, _LEFT
    while len(way.places) < _MOST:
        here = way.places[-1]
        outcome = _outcome(weight, way.places, way.far)
        if outcome is not None:
            return way.ended(outcome)
        if here.left <= (0.0 if here.slides else enough):
            free = released(here.solution)
            if free.converged:
                return way.ended(TrialOutcome.HELD, free)
            if here.left <= _LITTLE:
                break
            enough = _LITTLE
        ahead = way.onward(here, _step(way.places, step, way.far))
        if ahead is None:
            break
        step = ahead.sunk - here.sunk
        way.places.append(ahead)
    return way.ended(TrialOutcome.UNSOLVED)


def _first(
    weight: SharedWeight,
    here: _Place,
    predicted: float | None,
    rate: Callable[[ContactSolution], float | None],
) -> float:
    """First step down, over the object's height."""
    if predicted is not None:
        return float(np.clip(_PART * predicted / weight.tall, *_BOUNDS))
    slope = rate(here.solution) if here.left > _LEFT else None
    if slope is None or not slope > 0.0:
        return _FIRST
    return float(np.clip(_ALMOST * here.left / slope / weight.tall, *_BOUNDS))


class _Way:
    """Places that the object went through on its way down."""

    def __init__(
        self,
        weight: SharedWeight,
        bare: ContactSolution,
        moved: Callable[[ContactSolution, float], ContactSolution],
    ) -> None:
        self._weight, self._moved = weight, moved
        self._begin, self.far = weight.height(bare.last), _FAR * weight.tall
        self.places = [self._place(bare)]
        self._longest = np.inf

    def _place(self, solution: ContactSolution) -> _Place:
        there = solution.last
        sunk = self._weight.sunk(self._begin, self._weight.height(there))
        slides = self._weight.sliding(there) >= _ALL
        left, elsewhere, most = self._weight.left(there), self._weight.elsewhere(there), self._weight.most(there)
        return _Place(solution, sunk, left, elsewhere, slides, most)

    def onward(self, here: _Place, step: float) -> _Place | None:
        """Deeper by a step [m], or by less where that finds no equilibrium or goes too far."""
        ahead, step = None, min(step, self._longest)
        for _ in range(_TRIES):
            height = self._weight.lower(self._weight.height(here.solution.last), step)
            solution = self._moved(here.solution, height)
            if not solution.converged:
                self._longest = _AGAIN * step
                step *= _SHORTER
                continue
            ahead = self._place(solution)
            if ahead.left >= -_TOO_FAR:
                break
            step *= here.left / (here.left - ahead.left)
        return ahead

    def ended(self, outcome: TrialOutcome, free: ContactSolution | None = None) -> Lowering:
        """How it went; ``free`` is the equilibrium without the handle."""
        last = free or self.places[-1].solution
        borne = max(one.borne for one in self.places)
        if free is not None:
            borne = self._weight.most(free.last)
        instants = [instant for one in self.places[1:] for instant in one.solution.instants]
        sunk = self._weight.sunk(self._begin, self._weight.height(last.last))
        path = tuple((one.sunk, one.borne) for one in self.places)
        return Lowering(outcome, last, (*instants, *(free.instants if free else ())), borne, sunk, path)


def _outcome(weight: SharedWeight, places: list[_Place], far: float) -> TrialOutcome | None:
    """Whether it can be seen that the hand does not hold the object."""
    here = places[-1]
    if here.elsewhere > _LEFT:
        return TrialOutcome.STANDS
    if here.left <= (0.0 if here.slides else _LEFT):
        return None
    if not weight.force(here.solution.last) > 0.0:
        return TrialOutcome.APART
    if len(places) > 1 and here.slides and places[-2].slides:
        return TrialOutcome.SLIDES if max(_slope(places), 0.0) * (far - here.sunk) < here.left else None
    if len(places) > 1 and here.most < _CLEARLY and _presses(places) * (far - here.sunk) < 1.0 - here.most:
        return TrialOutcome.WEAK
    if here.borne < max(one.borne for one in places) - _LESS:
        return TrialOutcome.GIVES
    return TrialOutcome.SANK if here.sunk > far else None


def _step(places: list[_Place], step: float, far: float) -> float:
    """How much deeper to go, after a step [m]."""
    here = places[-1]
    if len(places) == 1:
        return step
    if here.slides and not places[-2].slides:
        return _PROBE * far
    longest, slope = min(_LONGER * step, _LONGEST * far), _slope(places)
    return min((here.left + _SPARE * here.slides) / slope, longest) if slope > 0.0 else longest


def _presses(places: list[_Place]) -> float:
    """How much more of the weight pressures could bear for each metre that the object sank last, 0 or more."""
    before, here = places[-2:]
    return max((here.most - before.most) / (here.sunk - before.sunk), 0.0)


def _slope(places: list[_Place]) -> float:
    """How much more of the weight the hand bears for each metre that the object sank last."""
    before, here = places[-2:]
    return (here.borne - before.borne) / (here.sunk - before.sunk)
