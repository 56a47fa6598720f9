"""Displacement-controlled lowering of an object into a hand until the hand bears its weight or cannot (R122–R124).

Under force control there is no equilibrium beyond the capacity of friction, and a solver that finds none has proved
nothing. With the height of the object's handle prescribed there is an equilibrium at every height: the reaction of the
handle is the weight not yet borne, and whether the hand bears more as the object sinks is measured.
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
"""Default first step down, over the object's height."""
_LONGER = 2.5
"""Largest ratio of successive steps."""
_FAR, _LONGEST = 0.25, 0.25
"""Descent, over the object's height, at which it counts as not held; and the longest step, over that descent."""
_MOST = 14
"""Most equilibria with the handle."""
_PART, _BOUNDS = 0.5, (_FIRST, 0.06)
"""Fraction of a descent known from another grip taken in the first step, and bounds of that step, over the object's
height."""
_ALMOST = 0.9
"""Fraction of the descent predicted by the tangent taken in the first step."""
_AGAIN = 0.6
"""Bound on later steps, over the length of a step without equilibrium: failures cost most."""
_SHORTER, _TRIES = 1.0 / 3.0, 3
"""Factor on a step without equilibrium, and number of attempts."""
_LEFT, _LITTLE = 0.01, 0.001
"""Share of the weight on the handle at which it is released; and the share tried next if that failed."""
_SPARE = 0.002
"""Share of the weight to be borne in excess of all of it where every point slides, as nothing may be left then."""
_LESS = 0.02
"""Drop of the borne share of the weight from its maximum at which the object counts as slipping out."""
_TOO_FAR = 0.1
"""Share of the weight borne in excess above which a step is repeated shorter: friction depends on history, and an
object lowered too far does not rise back."""
_CLEARLY = 0.9
"""Share of the weight that friction must be able to bear with the pressures for the descent to go on, unless they
grow."""
_PROBE = 0.05
"""Step once every point slides, over ``far``: long enough to measure whether more will be borne."""
_ALL = 1.0 - 1e-9
"""Share of the contact area that slides from which on all of it counts as sliding."""


@dataclass(frozen=True, eq=False)
class Lowering:
    """Result of a descent.

    Attributes:
        outcome: How it ended.
        solution: Last equilibrium; if the object is held, that without the handle.
        instants: All equilibria after the initial one, in order.
        borne: Largest share of the weight that the hand bore; if it holds, the share that it could bear.
        sunk: Total descent [m].
        path: Descent [m] and share of the weight borne by the hand, at every equilibrium with the handle.
    """

    outcome: TrialOutcome
    solution: ContactSolution
    instants: tuple[ContactInstant, ...]
    borne: float
    sunk: float
    path: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class _Lowered:
    """An equilibrium with the handle.

    Attributes:
        solution: The equilibrium.
        sunk: Descent so far [m].
        left: Share of the weight borne by the handle.
        elsewhere: Share of the weight borne by other bodies than the hand.
        slides: Whether every contact point slides.
        most: Share of the weight that friction could bear with the pressures.
    """

    solution: ContactSolution
    sunk: float
    left: float
    elsewhere: float
    slides: bool
    most: float

    @property
    def borne(self) -> float:
        """Share of the weight borne by the hand."""
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
    """Lower the handle until its reaction vanishes, then release it.

    Steps are chosen by the tangent (``rate``) first, and by the secant afterwards.

    Args:
        weight: Weight of the object, shared by hand and handle.
        bare: Equilibrium in which the handle bears what the hand does not.
        moved: Equilibrium after another, with the handle at a height [m].
        released: Equilibrium after another, without the handle.
        predicted: Descent at a similar grip [m]; None if not known.
        rate: Derivative of the share of the weight borne by the hand with respect to the descent [1/m], at an
            equilibrium with the handle; None if not known.
    """
    descent = _Descent(weight, bare, moved)
    first = _first(weight, descent.places[0], predicted, rate)
    step, enough = first * weight.tall, _LEFT
    while len(descent.places) < _MOST:
        here = descent.places[-1]
        outcome = _outcome(weight, descent.places, descent.far)
        if outcome is not None:
            return descent.ended(outcome)
        if here.left <= (0.0 if here.slides else enough):
            free = released(here.solution)
            if free.converged:
                return descent.ended(TrialOutcome.HELD, free)
            if here.left <= _LITTLE:
                break
            enough = _LITTLE
        ahead = descent.onward(here, _step(descent.places, step, descent.far))
        if ahead is None:
            break
        step = ahead.sunk - here.sunk
        descent.places.append(ahead)
    return descent.ended(TrialOutcome.UNSOLVED)


def _first(
    weight: SharedWeight,
    here: _Lowered,
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


class _Descent:
    """Equilibria of an object that is lowered."""

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

    def _place(self, solution: ContactSolution) -> _Lowered:
        there = solution.last
        sunk = self._weight.sunk(self._begin, self._weight.height(there))
        slides = self._weight.sliding(there) >= _ALL
        left, elsewhere, most = self._weight.left(there), self._weight.elsewhere(there), self._weight.most(there)
        return _Lowered(solution, sunk, left, elsewhere, slides, most)

    def onward(self, here: _Lowered, step: float) -> _Lowered | None:
        """Lower by a step [m], or by less if that has no equilibrium or goes too far; None if all attempts fail."""
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
        """Result with an outcome; ``free`` is the equilibrium without the handle, if there is one."""
        last = free or self.places[-1].solution
        borne = max(one.borne for one in self.places)
        if free is not None:
            borne = self._weight.most(free.last)
        instants = [instant for one in self.places[1:] for instant in one.solution.instants]
        sunk = self._weight.sunk(self._begin, self._weight.height(last.last))
        path = tuple((one.sunk, one.borne) for one in self.places)
        return Lowering(outcome, last, (*instants, *(free.instants if free else ())), borne, sunk, path)


def _outcome(weight: SharedWeight, places: list[_Lowered], far: float) -> TrialOutcome | None:
    """Outcome if the hand evidently does not hold the object; None to continue."""
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


def _step(places: list[_Lowered], step: float, far: float) -> float:
    """Next step down, given the last one [m]."""
    here = places[-1]
    if len(places) == 1:
        return step
    if here.slides and not places[-2].slides:
        return _PROBE * far
    longest, slope = min(_LONGER * step, _LONGEST * far), _slope(places)
    return min((here.left + _SPARE * here.slides) / slope, longest) if slope > 0.0 else longest


def _presses(places: list[_Lowered]) -> float:
    """Increase of the share that friction could bear per descent in the last step [1/m], at least 0."""
    before, here = places[-2:]
    return max((here.most - before.most) / (here.sunk - before.sunk), 0.0)


def _slope(places: list[_Lowered]) -> float:
    """Increase of the share borne by the hand per descent in the last step [1/m]."""
    before, here = places[-2:]
    return (here.borne - before.borne) / (here.sunk - before.sunk)
