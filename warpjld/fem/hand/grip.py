"""The gentlest grip that holds: force raised until nothing slides, or a reason why none holds (R123, R124).

A trial holds or it does not; the least grip is bracketed by growing and found by halving. Friction can carry no more
than μ times the sum of the normal forces. While that is below a few times the weight, sliding may mean that the grip is
too gentle; above it, sliding by a share that a doubled force does not change means that the forces pull out of their
friction cones, and no grip at these places will hold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.errors import InputError

__all__ = ["Grip", "GripStatus", "Trial", "gentlest_grip"]

_SAME = 0.02
_AMPLE = 4.0
"""Friction this many times the weight is not what is missing."""


class GripStatus(Enum):
    """How a search for a grip ended; the value is the message for people."""

    HELD = "held: the gentlest grip was found"
    HELD_AT_ONCE = "held by the gentlest grip that was allowed"
    NO_CONTACT = "nothing is touched however far the hand closes"
    TOO_WEAK = "more force would be needed than the muscles have"
    SLIDES = "slides at any force: the contact forces cannot lie inside their friction cones"
    LIMIT = "does not hold at the firmest grip that was allowed"
    NO_SOLUTION = "contact could not be solved"


@dataclass(frozen=True)
class Trial:
    """What one grip does.

    Attributes:
        held: Whether the weight is held without sliding.
        sliding: Share of the contact that slides, 0 … 1; NaN where nothing touches.
        force: Sum of the normal forces on the object [N].
        share: Largest share of the muscles' limits, 0 where it is not measured.
        who: Digit that has this share.
    """

    held: bool
    sliding: float
    force: float
    share: float = 0.0
    who: str = ""


@dataclass(frozen=True)
class Grip:
    """The gentlest grip, or the last one tried.

    Attributes:
        status: How the search ended.
        grip: Its measure, as handed to ``hold`` (an angle, a force, a share of closing).
        trial: What it does, None where contact was not solved.
        trials: Every grip tried, in order.
        text: For people.
    """

    status: GripStatus
    grip: float
    trial: Trial | None
    trials: tuple[tuple[float, Trial], ...]
    text: str


def gentlest_grip(
    hold: Callable[[float], Trial | None],
    low: float,
    high: float,
    *,
    weight: float,
    friction: float,
    start: float | None = None,
    tolerance: float = 0.02,
) -> Grip:
    """The smallest grip in low … high that holds.

    Args:
        hold: What a grip does; None where contact could not be solved.
        low: Gentlest grip allowed, below which nothing is tried.
        high: Firmest grip allowed.
        weight: What is to be held [N].
        friction: Coulomb's μ between hand and object.
        start: First step above ``low``, by default a sixteenth of the range; steps double from there.
        tolerance: How near to the gentlest, as a share of the grip's rise above ``low``.

    Raises:
        InputError: A range that is none.
    """
    if not (np.isfinite([low, high]).all() and low < high) or not 0.0 < tolerance < 1.0:
        raise InputError(f"grip: want low < high and a tolerance between 0 and 1, got {low}, {high}, {tolerance}")
    if not (weight >= 0.0 and np.isfinite(weight) and friction >= 0.0 and np.isfinite(friction)):
        raise InputError(f"grip: want a weight and a friction of 0 or more, got {weight} N and {friction}")
    step = (high - low) / 16.0 if start is None else float(start)
    if not 0.0 < step <= high - low:
        raise InputError(f"grip: want a first step above 0 within the range, got {step}")
    trials: list[tuple[float, Trial]] = []

    def ended(status: GripStatus, grip: float, trial: Trial | None) -> Grip:
        return Grip(status, grip, trial, tuple(trials), _text(status, trial))

    def attempt(grip: float) -> Trial | None:
        trial = hold(grip)
        if trial is not None:
            trials.append((grip, trial))
        return trial

    grip = low
    trial = attempt(grip)
    if trial is None:
        return ended(GripStatus.NO_SOLUTION, grip, None)
    if trial.held and trial.share <= 1.0:
        return ended(GripStatus.HELD_AT_ONCE, grip, trial)
    failed = low
    while not trial.held:
        if trial.share > 1.0:
            return ended(GripStatus.TOO_WEAK, grip, trial)
        if _slides_for_ever(trials, weight / friction if friction else np.inf):
            return ended(GripStatus.SLIDES, grip, trial)
        if grip >= high:
            return ended(GripStatus.NO_CONTACT if not trial.force > 0.0 else GripStatus.LIMIT, grip, trial)
        failed = grip
        grip = min(high, low + step)
        step *= 2.0
        trial = attempt(grip)
        if trial is None:
            return ended(GripStatus.NO_SOLUTION, grip, None)
    held, at_held = grip, trial
    while held - failed > tolerance * (held - low):
        middle = 0.5 * (failed + held)
        trial = attempt(middle)
        if trial is None:
            return ended(GripStatus.NO_SOLUTION, middle, None)
        if trial.held:
            held, at_held = middle, trial
        else:
            failed = middle
    if at_held.share > 1.0:
        return ended(GripStatus.TOO_WEAK, held, at_held)
    return ended(GripStatus.HELD, held, at_held)


def _slides_for_ever(trials: list[tuple[float, Trial]], needed: float) -> bool:
    """Whether ample force was doubled and slid by the same share."""
    if needed == np.inf:
        return len([t for _, t in trials if t.force > 0.0]) >= 3
    ample = [t for _, t in trials if t.force > _AMPLE * needed]
    if len(ample) < 2 or ample[-1].held:
        return False
    for earlier in reversed(ample[:-1]):
        if earlier.force <= 0.5 * ample[-1].force:
            return ample[-1].sliding > 0.0 and abs(earlier.sliding - ample[-1].sliding) < _SAME
    return False


def _text(status: GripStatus, trial: Trial | None) -> str:
    if trial is None or not trial.force > 0.0:
        return status.value
    out = f"{status.value}; {trial.force:.3g} N on the object"
    if trial.who:
        out += f", {trial.who} at {100.0 * trial.share:.0f} % of its limit"
    if not trial.held:
        out += f", {100.0 * trial.sliding:.0f} % of the contact slides"
    return out
