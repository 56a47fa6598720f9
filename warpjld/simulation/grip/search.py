"""The gentlest grip that holds: force raised until nothing slides, or a reason why none holds (R123, R124).

A trial holds or it does not; the least grip is bracketed by growing, and then looked for where the share of the weight
that trials could bear, in proportion, is all of it. Friction can carry no more than μ times the sum of the normal
forces. While that is below a few times the weight, sliding may mean that the grip is too gentle; above it, sliding by a
share that a doubled force does not change means that the forces pull out of their friction cones, and no grip at these
places will hold.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.grip.bracket import checked_step, clipped_inside, outward

__all__ = ["Grip", "GripStatus", "Trial", "TrialOutcome", "gentlest_grip"]

_SAME = 0.02
_AMPLE = 4.0
"""Friction this many times the weight is not what is missing."""
_INNER = 0.1
"""Part of a bracket, at either end, within which no grip is tried."""


class TrialOutcome(Enum):
    """How a trial ended; the value is what is said of one or several."""

    HELD = "held"
    APART = "pressed on nothing"
    WEAK = "pressed too little for friction to bear the weight"
    SLIDES = "slid at every point"
    GIVES = "slipped out: less was borne the deeper it sank"
    SANK = "sank away"
    STANDS = "left it standing on something else"
    UNSOLVED = "could not be solved"


_NO_MATTER_OF_FORCE = (TrialOutcome.STANDS, TrialOutcome.UNSOLVED)


class GripStatus(Enum):
    """How a search for a grip ended; the value is the message for people."""

    HELD = "held: the gentlest grip was found"
    HELD_AT_ONCE = "held by the gentlest grip that was allowed"
    NO_CONTACT = "nothing is touched however far the hand closes"
    TOO_WEAK = "more force would be needed than the muscles have"
    SLIDES = "slides at any force: the contact forces cannot lie inside their friction cones"
    STANDS = "it stands on something else, and the hand does not hold it"
    LIMIT = "does not hold at the firmest grip that was allowed"
    NO_SOLUTION = "contact could not be solved"


@dataclass(frozen=True)
class Trial:
    """What one grip does.

    Attributes:
        outcome: How it ended.
        sliding: Share of the contact that slides, 0 … 1; NaN where nothing touches.
        force: Sum of the normal forces on the object [N].
        borne: Share of the weight that the hand bore at most, or could have; NaN where it is not known.
        share: Largest share of the muscles' limits, 0 where it is not measured.
        who: Digit that has this share.
        note: More for people, as what the object stands on.
    """

    outcome: TrialOutcome
    sliding: float
    force: float
    borne: float = float("nan")
    share: float = 0.0
    who: str = ""
    note: str = ""

    @property
    def held(self) -> bool:
        """Whether the hand, and nothing else, holds the weight."""
        return self.outcome is TrialOutcome.HELD


@dataclass(frozen=True)
class Grip:
    """The gentlest grip, or the last one tried.

    Attributes:
        status: How the search ended.
        grip: Its measure, as handed to ``hold`` (an angle, a force, a share of closing).
        trial: What it does.
        trials: Every grip tried, in order.
        text: For people.
    """

    status: GripStatus
    grip: float
    trial: Trial
    trials: tuple[tuple[float, Trial], ...]
    text: str

    @property
    def ended(self) -> str:
        """How the trials ended, with the number of each: "5 grips were tried: 2 held, 3 slid at every point"."""
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
) -> Grip:
    """The smallest grip in low … high that holds.

    A trial that could not be solved says nothing; the search goes on beside it, and counts it.

    Args:
        hold: What a grip does.
        low: Gentlest grip allowed, below which nothing is tried.
        high: Firmest grip allowed.
        weight: What is to be held [N].
        friction: Coulomb's μ between hand and object.
        start: First step above ``low``, by default a sixteenth of the range; steps double from there.
        tolerance: How near to the gentlest, as a share of the grip's rise above ``low``.

    Raises:
        InputError: A range that is none.
    """
    step = checked_step(low, high, start)
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"grip: want a tolerance between 0 and 1, got {tolerance}")
    if not (weight >= 0.0 and np.isfinite(weight) and friction >= 0.0 and np.isfinite(friction)):
        raise InputError(f"grip: want a weight and a friction of 0 or more, got {weight} N and {friction}")
    trials: list[tuple[float, Trial]] = []

    def attempt(grip: float) -> tuple[float, Trial]:
        trials.append((grip, hold(grip)))
        return trials[-1]

    def ended(status: GripStatus, grip: float, trial: Trial) -> Grip:
        return Grip(status, grip, trial, tuple(trials), _text(status, trial))

    needed = weight / friction if friction else np.inf
    failed = None
    for grip in outward(low, high, step, 2.0, from_low=True):
        one = attempt(grip)
        if one[1].held:
            break
        status = _given_up(trials, grip >= high, needed)
        if status is not None:
            return ended(status, *one)
        failed = one
    if failed is None and one[1].share <= 1.0:
        return ended(GripStatus.HELD_AT_ONCE, *one)
    held = _narrowed(attempt, failed or one, one, low, tolerance)
    return ended(GripStatus.TOO_WEAK if held[1].share > 1.0 else GripStatus.HELD, *held)


def _narrowed(
    attempt: Callable[[float], tuple[float, Trial]],
    failed: tuple[float, Trial],
    held: tuple[float, Trial],
    low: float,
    tolerance: float,
) -> tuple[float, Trial]:
    """The gentlest grip that holds, between one that does not and one that does."""
    shrank = True
    while (room := held[0] - failed[0]) > tolerance * (held[0] - low):
        middle = 0.5 * (failed[0] + held[0])
        one = attempt(_between(failed, held, tolerance * (held[0] - low)) if shrank else middle)
        failed, held = (failed, one) if one[1].held else (one, held)
        shrank = held[0] - failed[0] <= 0.5 * room
    return held


def _given_up(trials: list[tuple[float, Trial]], last: bool, needed: float) -> GripStatus | None:
    """Why nothing firmer is tried after a grip that does not hold."""
    trial = trials[-1][1]
    if trial.share > 1.0:
        return GripStatus.TOO_WEAK
    if _slides_for_ever(trials, needed):
        return GripStatus.SLIDES
    return _at_last(trial) if last else None


def _between(failed: tuple[float, Trial], held: tuple[float, Trial], width: float) -> float:
    """The grip to try next: beside the one at which all of the weight would be borne, so that the bracket closes."""
    (low, gentle), (high, firm) = failed, held
    lacks, spares = 1.0 - gentle.borne, firm.borne - 1.0
    room = high - low
    if room <= 2.0 * width or not (lacks > 0.0 and spares >= 0.0):  # NaN included
        return 0.5 * (low + high)
    there = low + room * lacks / (lacks + spares)
    beside = there + 0.5 * width if high - there > there - low else there - 0.5 * width
    return clipped_inside(beside, low, high, _INNER)


def _at_last(trial: Trial) -> GripStatus:
    """Why the firmest grip does not hold."""
    known = {TrialOutcome.UNSOLVED: GripStatus.NO_SOLUTION, TrialOutcome.STANDS: GripStatus.STANDS}
    if trial.outcome in known:
        return known[trial.outcome]
    return GripStatus.LIMIT if trial.force > 0.0 else GripStatus.NO_CONTACT


def _slides_for_ever(trials: list[tuple[float, Trial]], needed: float) -> bool:
    """Whether ample force was doubled and slid by the same share."""
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
