"""Search for the grip with a given total force, or the reason why there is none (R118, R123).

The digits close from one load step to the next and stop at the first whose force is enough. Every step on the way is
an equilibrium, so that no grip is tried far beyond the force that is asked for, where flesh is thin and equilibria are
hard to find. Between the last two steps the grip is interpolated (``Bracket``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.errors import InputError
from warpjld.simulation.grip.bracket import Bracket, checked_step

__all__ = ["ForceGrip", "ForceStatus", "PressedForce", "force_grip"]

_ROUNDS = 12
"""Most grips gone to, beside those on the way to the first that is enough; one or two are, as a rule."""


class ForceStatus(Enum):
    """How a search for a force ended; the value is the message."""

    REACHED = "the digits press as asked"
    UNEVEN = "the digits press with that force, but not each with the same share of its muscles"
    HARDER_ALREADY = "the digits press harder than that before they close on"
    TOO_WEAK = "unreachable: more force would be needed than the muscles have"
    UNOPPOSED = "unreachable: nothing opposes more, which would push the object away"
    LIMIT = "unreachable: the digits are bent as far as they may"
    NO_CONTACT = "nothing is touched however far the digits bend"
    NO_SOLUTION = "contact could not be solved at a firmer grip"
    EXHAUSTED = "the linear solves allowed were spent before the force was reached"
    INTERRUPTED = "the search was interrupted before the force was reached"


@dataclass(frozen=True)
class PressedForce:
    """Force of a grip.

    Attributes:
        force: Total force [N].
        share: Largest load share (load over limit) of the muscles.
        who: Digit with that share.
    """

    force: float
    share: float = 0.0
    who: str = ""


@dataclass(frozen=True)
class ForceGrip:
    """The grip found, or the nearest grip tried that the muscles can hold.

    Attributes:
        status: How the search ended.
        grip: Grip, as ``close`` counts it.
        pressed: Its force; None if no grip was solved.
        trials: Every grip tried, in order.
        text: Summary in one line.
    """

    status: ForceStatus
    grip: float
    pressed: PressedForce | None
    trials: tuple[tuple[float, PressedForce], ...]
    text: str


def force_grip(
    close: Callable[[float], Iterator[tuple[float, PressedForce]]],
    low: float,
    high: float,
    force: float,
    *,
    tolerance: float = 0.02,
    exhausted: Callable[[], bool] = lambda: False,
) -> ForceGrip:
    """Close until a force is reached.

    Args:
        close: Grips and their forces, which increase, on the way to a grip and at it; they end before it where contact
            could not be solved. What is not asked for is not solved.
        low: Smallest grip.
        high: Largest grip.
        force: Target force [N].
        tolerance: Relative tolerance of the force.
        exhausted: Whether nothing more may be solved.

    Raises:
        InputError: Range, force or tolerance out of range.
    """
    if not (np.isfinite(force) and force > 0.0 and 0.0 < tolerance < 1.0):
        raise InputError(f"grip: want a force above 0 N and a tolerance between 0 and 1, got {force}, {tolerance}")
    trials: list[tuple[float, PressedForce]] = []
    bracket = Bracket(low, high, force, checked_step(low, high, None))
    grip = low
    for _ in range(_ROUNDS):
        at = None
        try:
            for at, found in close(grip):
                trials.append((at, found))
                bracket.note(at, found.force, None, enough=found.force >= force)
                status = _status(found, force, tolerance, at, low, high)
                if status is not None:
                    return _ended(status, force, low, trials)
                if found.force >= force:
                    break
            else:
                if at != grip:
                    break
        except KeyboardInterrupt:
            return _ended(ForceStatus.INTERRUPTED, force, low, trials)
        ahead = high if bracket.above is None else bracket.next()
        if ahead is None:
            break
        grip = ahead
    return _ended(ForceStatus.EXHAUSTED if exhausted() else ForceStatus.NO_SOLUTION, force, low, trials)


def _status(
    found: PressedForce, force: float, tolerance: float, grip: float, low: float, high: float
) -> ForceStatus | None:
    """Status with which a grip ends the search; None to continue."""
    if abs(found.force - force) <= tolerance * force:
        return ForceStatus.REACHED if found.share <= 1.0 else ForceStatus.TOO_WEAK
    if found.force > force:
        return ForceStatus.HARDER_ALREADY if grip <= low else None
    if found.share > 1.0:
        return ForceStatus.TOO_WEAK
    if grip >= high:
        return ForceStatus.LIMIT if found.force > 0.0 else ForceStatus.NO_CONTACT
    return None


def _ended(status: ForceStatus, force: float, low: float, trials: list[tuple[float, PressedForce]]) -> ForceGrip:
    """Result with the grip nearest to the force that muscles can hold; from below if the force was not reached."""
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
