"""The grip that presses with a wished force, or a reason why none does (R118, R123)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.errors import InputError

__all__ = ["Firm", "FirmStatus", "Firmness", "grip_of_force"]

_ROUNDS = 16


class FirmStatus(Enum):
    """How a search for a force ended; the value is the message for people."""

    REACHED = "the digits press as asked"
    HARDER_ALREADY = "the digits press harder than that before they close on"
    TOO_WEAK = "unreachable: more force would be needed than the muscles have"
    LIMIT = "unreachable: the digits are bent as far as they may"
    NO_CONTACT = "nothing is touched however far the digits bend"
    NO_SOLUTION = "contact could not be solved at a firmer grip"


@dataclass(frozen=True)
class Firmness:
    """What a grip presses with: force [N], the largest share of the muscles' limits, and the digit that has it."""

    force: float
    share: float = 0.0
    who: str = ""


@dataclass(frozen=True)
class Firm:
    """The grip found, or the firmest that muscles can hold of those tried.

    Attributes:
        status: How the search ended.
        grip: Its measure, as handed to ``press``.
        firmness: What it presses with; None where no grip was solved.
        trials: Every grip tried, in order.
        text: For people.
    """

    status: FirmStatus
    grip: float
    firmness: Firmness | None
    trials: tuple[tuple[float, Firmness], ...]
    text: str


def grip_of_force(
    press: Callable[[float], Firmness | None],
    low: float,
    high: float,
    force: float,
    *,
    start: float | None = None,
    tolerance: float = 0.02,
) -> Firm:
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
    if not (np.isfinite([low, high, force]).all() and low < high and force > 0.0 and 0.0 < tolerance < 1.0):
        raise InputError(
            f"grip: want low < high, a force above 0 N and a tolerance between 0 and 1, got {low}, {high}, {force}, "
            f"{tolerance}"
        )
    step = (high - low) / 16.0 if start is None else min(float(start), high - low)
    if not step > 0.0:
        raise InputError(f"grip: want a first step above 0, got {step}")
    trials: list[tuple[float, Firmness]] = []

    def ended(status: FirmStatus) -> Firm:
        able = [one for one in trials if one[1].share <= 1.0]
        near = able if status is FirmStatus.REACHED else [one for one in able if one[1].force <= force]
        if not near:
            return Firm(
                status, low, trials[0][1] if trials else None, tuple(trials), _text(status, force, trials, None)
            )
        best = min(near, key=lambda one: abs(one[1].force - force))
        return Firm(status, best[0], best[1], tuple(trials), _text(status, force, trials, best[1]))

    grip = below = low
    least = 0.0
    found = press(grip)
    while found is not None:
        trials.append((grip, found))
        if abs(found.force - force) <= tolerance * force and found.share <= 1.0:
            return ended(FirmStatus.REACHED)
        if found.force >= force:
            break
        if found.share > 1.0:
            return ended(FirmStatus.TOO_WEAK)
        if grip >= high:
            return ended(FirmStatus.LIMIT if found.force > 0.0 else FirmStatus.NO_CONTACT)
        below, least = grip, found.force - force
        grip = min(high, grip + step)
        step *= 1.5
        found = press(grip)
    if found is None:
        return ended(FirmStatus.NO_SOLUTION)
    if grip == low:
        return ended(FirmStatus.HARDER_ALREADY)
    above, most = grip, found.force - force
    for _ in range(_ROUNDS):
        share = float(np.clip(least / (least - most), 0.05, 0.95))
        grip = below + share * (above - below)
        found = press(grip)
        if found is None:
            return ended(FirmStatus.NO_SOLUTION)
        trials.append((grip, found))
        if abs(found.force - force) <= tolerance * force:
            return ended(FirmStatus.REACHED if found.share <= 1.0 else FirmStatus.TOO_WEAK)
        if found.force < force:
            if found.share > 1.0:
                return ended(FirmStatus.TOO_WEAK)
            below, least, most = grip, found.force - force, 0.5 * most
        else:
            above, most, least = grip, found.force - force, 0.5 * least
    return ended(FirmStatus.NO_SOLUTION)


def _text(status: FirmStatus, force: float, trials: list[tuple[float, Firmness]], best: Firmness | None) -> str:
    out = f"{status.value}; {force:.3g} N asked for"
    if best is None:
        return out + (f", {trials[0][1].force:.3g} N at the gentlest grip" if trials else "")
    out += f", {best.force:.3g} N reached"
    if best.who:
        out += f" with {best.who} at {100.0 * best.share:.0f} % of its limit"
    over = [one for _, one in trials if one.share > 1.0]
    if status is FirmStatus.TOO_WEAK and over:
        worst = min(over, key=lambda one: one.force)
        out += f"; {worst.force:.3g} N would take {100.0 * worst.share:.0f} % of what {worst.who} can"
    return out
