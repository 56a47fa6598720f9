"""The grip that presses with a wished force, or a reason why none does (R118, R123)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.grip.bracket import checked_step, clipped_inside, outward

__all__ = ["ForceGrip", "ForceStatus", "PressedForce", "force_grip"]

_ROUNDS = 16


class ForceStatus(Enum):
    """How a search for a force ended; the value is the message for people."""

    REACHED = "the digits press as asked"
    HARDER_ALREADY = "the digits press harder than that before they close on"
    TOO_WEAK = "unreachable: more force would be needed than the muscles have"
    LIMIT = "unreachable: the digits are bent as far as they may"
    NO_CONTACT = "nothing is touched however far the digits bend"
    NO_SOLUTION = "contact could not be solved at a firmer grip"


@dataclass(frozen=True)
class PressedForce:
    """What a grip presses with: force [N], the largest share of the muscles' limits, and the digit that has it."""

    force: float
    share: float = 0.0
    who: str = ""


@dataclass(frozen=True)
class ForceGrip:
    """The grip found, or the firmest that muscles can hold of those tried.

    Attributes:
        status: How the search ended.
        grip: Its measure, as handed to ``press``.
        pressed: What it presses with; None where no grip was solved.
        trials: Every grip tried, in order.
        text: For people.
    """

    status: ForceStatus
    grip: float
    pressed: PressedForce | None
    trials: tuple[tuple[float, PressedForce], ...]
    text: str


def force_grip(
    press: Callable[[float], PressedForce | None],
    low: float,
    high: float,
    force: float,
    *,
    start: float | None = None,
    tolerance: float = 0.02,
) -> ForceGrip:
    """Close until a force is reached: steps that grow, then regula falsi between the last two.

    Args:
        press: What a grip presses with, more the firmer; None where contact could not be solved.
        low: Gentlest grip.
        high: Firmest grip allowed.
        force: Wished [N].
        start: First step above ``low``, by default a sixteenth of the range; steps grow by half from there.
        tolerance: Of the force, as a share.

    Raises:
        InputError: A range or a force that is none.
    """
    step = checked_step(low, high, None if start is None else min(float(start), high - low))
    if not (np.isfinite(force) and force > 0.0 and 0.0 < tolerance < 1.0):
        raise InputError(f"grip: want a force above 0 N and a tolerance between 0 and 1, got {force}, {tolerance}")
    trials: list[tuple[float, PressedForce]] = []

    def attempt(grip: float) -> PressedForce | None:
        found = press(grip)
        if found is not None:
            trials.append((grip, found))
        return found

    below, status = None, None
    for grip in outward(low, high, step, 1.5, from_low=False):
        found = attempt(grip)
        status = _outward_status(found, force, tolerance, grip >= high)
        if status is not None or (found is not None and found.force >= force):
            break
        below = trials[-1]
    if status is None and below is not None:
        status = _narrowed(attempt, below, trials[-1], force, tolerance)
    return _ended(status or ForceStatus.HARDER_ALREADY, force, low, trials)


def _outward_status(found: PressedForce | None, force: float, tolerance: float, last: bool) -> ForceStatus | None:
    """How the search ends while grips become firmer; None where it goes on, outwards or inside."""
    if found is None:
        return ForceStatus.NO_SOLUTION
    if abs(found.force - force) <= tolerance * force and found.share <= 1.0:
        return ForceStatus.REACHED
    if found.force >= force:
        return None
    if found.share > 1.0:
        return ForceStatus.TOO_WEAK
    if last:
        return ForceStatus.LIMIT if found.force > 0.0 else ForceStatus.NO_CONTACT
    return None


def _narrowed(
    attempt: Callable[[float], PressedForce | None],
    gentle: tuple[float, PressedForce],
    firm: tuple[float, PressedForce],
    force: float,
    tolerance: float,
) -> ForceStatus:
    """Regula falsi (Illinois) between a grip that presses too little and one that presses too much."""
    below, least = gentle[0], gentle[1].force - force
    above, most = firm[0], firm[1].force - force
    for _ in range(_ROUNDS):
        share = clipped_inside(least / (least - most), 0.0, 1.0, 0.05)
        grip = below + share * (above - below)
        found = attempt(grip)
        if found is None:
            return ForceStatus.NO_SOLUTION
        if abs(found.force - force) <= tolerance * force:
            return ForceStatus.REACHED if found.share <= 1.0 else ForceStatus.TOO_WEAK
        if found.force < force:
            if found.share > 1.0:
                return ForceStatus.TOO_WEAK
            below, least, most = grip, found.force - force, 0.5 * most
        else:
            above, most, least = grip, found.force - force, 0.5 * least
    return ForceStatus.NO_SOLUTION


def _ended(status: ForceStatus, force: float, low: float, trials: list[tuple[float, PressedForce]]) -> ForceGrip:
    """The grip of a status: the nearest to the force that muscles can hold, from below if it is not reached."""
    able = [one for one in trials if one[1].share <= 1.0]
    near = able if status is ForceStatus.REACHED else [one for one in able if one[1].force <= force]
    if not near:
        first = trials[0][1] if trials else None
        return ForceGrip(status, low, first, tuple(trials), _text(status, force, trials, None))
    best = min(near, key=lambda one: abs(one[1].force - force))
    return ForceGrip(status, best[0], best[1], tuple(trials), _text(status, force, trials, best[1]))


def _text(
    status: ForceStatus, force: float, trials: list[tuple[float, PressedForce]], best: PressedForce | None
) -> str:
    out = f"{status.value}; {force:.3g} N asked for"
    if best is None:
        return out + (f", {trials[0][1].force:.3g} N at the gentlest grip" if trials else "")
    out += f", {best.force:.3g} N reached"
    if best.who:
        out += f" with {best.who} at {100.0 * best.share:.0f} % of its limit"
    over = [one for _, one in trials if one.share > 1.0]
    if status is ForceStatus.TOO_WEAK and over:
        worst = min(over, key=lambda one: one.force)
        out += f"; {worst.force:.3g} N would take {100.0 * worst.share:.0f} % of what {worst.who} can"
    return out
