"""Search for the smallest grip that holds an object, or the reason why none does (R123, R124).

A trial holds or not, which is no smooth function of the grip. The search uses the capacity instead: the share of the
weight that friction could bear with the pressures of the trial if all of it pointed up. It increases smoothly with the
grip, and its slope is known from the tangent (``Bracket``). Two pads beside a block hold it from a capacity of 1 on.
Other grips need more, since friction also balances moments and opposing digits: after a trial with capacity m that
slides at every point and bears a share b < 1, the target becomes m / b, or what two such trials extrapolate to. A grip
is the gentlest if its capacity is no more than that within the tolerance, or if friction could bear hardly more than
the weight with the pressures under it.

As long as friction can carry only a few times the weight, sliding may mean that the grip is too small. Beyond that, a
sliding share that does not change when the force doubles means that contact forces cannot lie in their friction cones,
and no grip at these contacts holds.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.grip.bracket import Bracket, checked_step

__all__ = ["Grip", "GripStatus", "Trial", "TrialOutcome", "gentlest_grip"]

_SAME = 0.02
"""Difference of sliding shares that counts as none; also the width of a bracket, relative to the tolerance, at which
the search ends."""
_AMPLE = 4.0
"""Ratio of available friction to weight above which more force would not help."""
_MARGIN = 0.8
"""Part of the tolerance by which grips are tried above what is needed: just below it they creep, which costs most."""
_FIRMER = 1.4
"""Least ratio of capacities of a grip that does not hold and the next one, until one holds: what an object that turns
or rolls out of a grip is short of is not known by its weight. Trials between the two follow."""
_TRIALS = 24
"""Most grips tried; with slopes three or four are enough."""


class TrialOutcome(Enum):
    """How a trial ended; the value completes a message about one or several trials."""

    HELD = "held"
    APART = "pressed on nothing"
    WEAK = "pressed too little for friction to bear the weight"
    SLIDES = "slid at every point"
    GIVES = "slipped, turned or rolled on without coming to rest"
    SANK = "sank away"
    STANDS = "left it standing on something else"
    UNSOLVED = "could not be solved"


_NO_MATTER_OF_FORCE = (TrialOutcome.STANDS, TrialOutcome.UNSOLVED)
"""Outcomes that do not depend on the force."""


class GripStatus(Enum):
    """How a search for a grip ended; the value is the message."""

    HELD = "held: the gentlest grip was found"
    HELD_AT_ONCE = "held by the gentlest grip that was allowed"
    NO_CONTACT = "nothing is touched however far the hand closes"
    TOO_WEAK = "more force would be needed than the muscles have"
    SLIDES = "slides at any force: the contact forces cannot lie inside their friction cones"
    STANDS = "it stands on something else, and the hand does not hold it"
    LIMIT = "does not hold at the firmest grip that was allowed"
    NO_SOLUTION = "contact could not be solved"
    EXHAUSTED = "no grip that holds was found with the trials and linear solves allowed"
    HELD_SO_FAR = "held, but not by the gentlest grip for certain: the trials or linear solves allowed were spent"
    INTERRUPTED = "the search was interrupted before a grip was found"


@dataclass(frozen=True)
class Trial:
    """Result of trying one grip.

    Attributes:
        outcome: How the trial ended.
        sliding: Share of the contact area that slides, 0 … 1; NaN without contact.
        force: Sum of the normal forces on the object [N].
        borne: Largest share of the weight that the hand bore or could have borne; NaN if not known.
        share: Largest load share (load over limit) of the muscles; 0 if not measured.
        who: Digit with that share.
        note: Addition to messages, as what the object stands on.
        capacity: Share of the weight that friction could bear with the pressures if all of it pointed up; NaN if not
            known (``borne`` is used then).
        slope: Derivative of the capacity with respect to the grip; None if not known.
        loaded: Whether the pressures are those under the weight.
        pressed: Sum of the normal forces on the object before the weight acted [N]; NaN if not known.
        telling: Whether ``borne`` tells how much more capacity is needed: not if the object slipped out or rolled while
            points still stuck.
    """

    outcome: TrialOutcome
    sliding: float
    force: float
    borne: float = float("nan")
    share: float = 0.0
    who: str = ""
    note: str = ""
    capacity: float = float("nan")
    slope: float | None = None
    loaded: bool = True
    pressed: float = float("nan")
    telling: bool = True

    @property
    def able(self) -> float:
        """The capacity; ``borne`` if it is not known."""
        return self.borne if np.isnan(self.capacity) else self.capacity

    @property
    def held(self) -> bool:
        """Whether the hand alone holds the weight."""
        return self.outcome is TrialOutcome.HELD


@dataclass(frozen=True)
class Grip:
    """The smallest grip found, or the last one tried.

    Attributes:
        status: How the search ended.
        grip: Grip, the argument of ``hold`` (an angle, a force, a share of closing).
        trial: Its trial.
        trials: Every grip tried, in order.
        text: Summary in one line.
    """

    status: GripStatus
    grip: float
    trial: Trial
    trials: tuple[tuple[float, Trial], ...]
    text: str

    @property
    def ended(self) -> str:
        """Numbers of trials by outcome: "5 grips were tried: 2 held, 3 slid at every point"."""
        count = Counter(trial.outcome for _, trial in self.trials)
        parts = ", ".join(f"{count[outcome]} {outcome.value}" for outcome in TrialOutcome if count[outcome])
        return f"{len(self.trials)} grip{'s were' if len(self.trials) > 1 else ' was'} tried: {parts}"


def gentlest_grip(
    hold: Callable[[float], Trial],
    low: float,
    high: float,
    *,
    weight: float,
    friction: float,
    start: float | None = None,
    tolerance: float = 0.02,
    most: int = _TRIALS,
    exhausted: Callable[[], bool] = lambda: False,
) -> Grip:
    """Smallest grip in ``low`` … ``high`` that holds.

    A trial that could not be solved is no information; the search goes on next to it, and counts it.

    Args:
        hold: Trial of a grip.
        low: Smallest grip allowed.
        high: Largest grip allowed.
        weight: Weight to hold [N].
        friction: Coulomb's μ between hand and object.
        start: First step above ``low`` without contact; by default a sixteenth of the range.
        tolerance: Tolerance of the smallest grip, relative to the force.
        most: Most trials; after that the smallest grip that held is returned, or else the one that came nearest.
        exhausted: Whether the linear solves allowed are spent, asked after every trial; with the same consequence.

    Returns:
        The grip found; if Ctrl-C ends the search, the trials so far with ``GripStatus.INTERRUPTED``.

    Raises:
        InputError: An argument out of range.
    """
    step = checked_step(low, high, start)
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"grip: want a tolerance between 0 and 1, got {tolerance}")
    if not (weight >= 0.0 and np.isfinite(weight) and friction >= 0.0 and np.isfinite(friction)):
        raise InputError(f"grip: want a weight and a friction of 0 or more, got {weight} N and {friction}")
    search = _Search(hold, Bracket(low, high, 1.0 + _MARGIN * tolerance, step), tolerance)
    needed = weight / friction if friction else np.inf
    try:
        return search.run(needed, most, exhausted)
    except KeyboardInterrupt:
        return search.interrupted()


class _Search:
    """State of the search: bracket and trials so far."""

    def __init__(self, hold: Callable[[float], Trial], bracket: Bracket, tolerance: float) -> None:
        self._hold, self._bracket, self._tolerance = hold, bracket, tolerance
        self._aim = self._needed = bracket.target
        self._slid: list[tuple[float, float]] = []
        self.trials: list[tuple[float, Trial]] = []

    def run(self, needed: float, most: int, exhausted: Callable[[], bool]) -> Grip:
        bracket, grip = self._bracket, self._bracket.low
        while len(self.trials) < most:
            trial = self._hold(grip)
            self.trials.append((grip, trial))
            self._note(grip, trial)
            if trial.held and (grip <= bracket.low or self._near(trial)):
                return self._ended(GripStatus.HELD_AT_ONCE if grip <= bracket.low else GripStatus.HELD, grip, trial)
            if bracket.above is None:
                status = _given_up(self.trials, grip >= bracket.high, needed)
                if status is not None:
                    return self._ended(status, grip, trial)
            if exhausted():
                return self.exhausted()
            ahead = bracket.next()
            if ahead is None or self._narrow():
                return self.best(_at_last(self.trials[-1][1]))
            grip = ahead
        return self.exhausted()

    def best(self, otherwise: GripStatus) -> Grip:
        """The smallest grip that held; if none did, the last one tried, with the status ``otherwise``."""
        held = [one for one in self.trials if one[1].held]
        if held:
            return self._ended(GripStatus.HELD, *min(held, key=lambda one: one[0]))
        return self._ended(otherwise, *self.trials[-1])

    def exhausted(self) -> Grip:
        """The smallest grip that held; if none did, the solved one that friction would have let bear the most."""
        held = [one for one in self.trials if one[1].held]
        if held:
            return self._ended(GripStatus.HELD_SO_FAR, *min(held, key=lambda one: one[0]))
        nearest = max(self.trials, key=lambda one: np.nan_to_num(one[1].able, nan=-1.0))
        return self._ended(GripStatus.EXHAUSTED, *nearest)

    def interrupted(self) -> Grip:
        """Result with the trials so far."""
        if not self.trials:
            nothing = Trial(TrialOutcome.UNSOLVED, float("nan"), 0.0)
            return Grip(GripStatus.INTERRUPTED, self._bracket.low, nothing, (), GripStatus.INTERRUPTED.value)
        return self._ended(GripStatus.INTERRUPTED, *self.trials[-1])

    def _note(self, grip: float, trial: Trial) -> None:
        if trial.loaded and not any(one.loaded for _, one in self.trials[:-1]):
            self._bracket.distrust()  # earlier capacities are those before the weight acted
        slid = trial.outcome is TrialOutcome.SLIDES or trial.able > 1.0  # else it is too weak whatever else it bears
        if slid and trial.telling and not trial.held and 0.0 < trial.borne < min(1.0, trial.able):
            self._needed = self._aim * self._enough(trial.able, trial.borne)
        self._bracket.note(grip, trial.able, trial.slope, enough=trial.held)
        self._bracket.target = max(self._needed, self._firmer(trial))

    def _enough(self, able: float, borne: float) -> float:
        """Capacity at which all of the weight would be borne, by a trial that slid and the one before.

        Pressed twice as hard, what slides bears twice as much; as grips also differ in where they press, the share
        borne is extrapolated once two are known.
        """
        self._slid.append((able, borne))
        out = able / borne
        if len(self._slid) > 1:
            (less, lower), (more, higher) = sorted(self._slid)[-2:]
            if more > less and higher > lower:
                out = max(out, more + (1.0 - higher) * (more - less) / (higher - lower))
        return out

    def _firmer(self, trial: Trial) -> float:
        """Least capacity to try next after an object slipped, turned or rolled out of a grip; 0 otherwise."""
        slipped = (TrialOutcome.SLIDES, TrialOutcome.GIVES, TrialOutcome.SANK)
        fails = any(one.outcome in slipped and not one.telling for _, one in self.trials)
        below, above = self._bracket.below, self._bracket.above
        if not fails or below is None or not below.value > 0.0:
            return 0.0
        return _FIRMER * below.value if above is None else float(np.sqrt(below.value * above.value))

    def _near(self, trial: Trial) -> bool:
        """Whether the capacity exceeds the target by no more than the tolerance, or what friction could bear under the
        weight exceeds the weight by no more: then no grip holds that presses less by more than that."""
        if 1.0 < trial.borne <= 1.0 + self._tolerance:  # trials that do not tell more than that all is borne give 1
            return True
        return trial.able <= self._needed / self._aim * (1.0 + self._tolerance)

    def _narrow(self) -> bool:
        """Whether the bracket is narrower than the tolerance."""
        below, above = self._bracket.below, self._bracket.above
        if below is None or above is None:
            return False
        pressed = {grip: trial.pressed for grip, trial in self.trials}
        firmer, gentler = pressed[above.grip], pressed[below.grip]
        if 0.0 < gentler <= firmer:  # comparable whether a grip holds or not
            return firmer <= (1.0 + self._tolerance) * gentler
        share = self._bracket.width / (above.grip - self._bracket.low)
        if 0.0 < below.value < above.value:
            return above.value <= (1.0 + self._tolerance) * below.value or share <= _SAME * self._tolerance
        return share <= self._tolerance

    def _ended(self, status: GripStatus, grip: float, trial: Trial) -> Grip:
        if trial.held and trial.share > 1.0 and status is not GripStatus.INTERRUPTED:
            status = GripStatus.TOO_WEAK
        return Grip(status, grip, trial, tuple(self.trials), _text(status, trial))


def _given_up(trials: list[tuple[float, Trial]], last: bool, needed: float) -> GripStatus | None:
    """Status if no larger grip has to be tried after one that does not hold; None to continue."""
    trial = trials[-1][1]
    if trial.share > 1.0:
        return GripStatus.TOO_WEAK
    if _slides_for_ever(trials, needed):
        return GripStatus.SLIDES
    return _at_last(trial) if last else None


def _at_last(trial: Trial) -> GripStatus:
    """Status if the last grip does not hold."""
    known = {TrialOutcome.UNSOLVED: GripStatus.NO_SOLUTION, TrialOutcome.STANDS: GripStatus.STANDS}
    if trial.outcome in known:
        return known[trial.outcome]
    return GripStatus.LIMIT if trial.force > 0.0 else GripStatus.NO_CONTACT


def _slides_for_ever(trials: list[tuple[float, Trial]], needed: float) -> bool:
    """Whether the sliding share stayed the same while ample force was doubled."""
    if needed == np.inf:
        return len([t for _, t in trials if t.force > 0.0]) >= 3
    ample = [t for _, t in trials if t.force > _AMPLE * needed and t.outcome not in _NO_MATTER_OF_FORCE]
    if len(ample) < 2 or ample[-1].held:
        return False
    for earlier in reversed(ample[:-1]):
        if earlier.force <= 0.5 * ample[-1].force:
            return ample[-1].sliding > 0.0 and abs(earlier.sliding - ample[-1].sliding) < _SAME
    return False


def _text(status: GripStatus, trial: Trial) -> str:
    if not trial.force > 0.0:
        return status.value
    out = f"{status.value}; {trial.force:.3g} N on the object"
    if trial.who:
        out += f", {trial.who} at {100.0 * trial.share:.0f} % of its limit"
    if trial.note:
        out += f", {trial.note}"
    if not trial.held and np.isfinite(trial.sliding):
        out += f", {100.0 * trial.sliding:.0f} % of the contact slides"
    return out
