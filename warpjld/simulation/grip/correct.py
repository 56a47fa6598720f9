"""Opening digits until muscles can hold them: bones' positions corrected automatically (R120)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.muscles import Effort
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["Corrected", "Correction", "correct_angles"]

_FLEXION = CHANNELS.index("flexion")
_KNUCKLES = ("base", "knuckle2", "knuckle3")
_FIRST = 0.04
"""Share of the way back that is tried first."""


class Correction(Enum):
    """How a correction ended; the value is the message for people."""

    NOT_NEEDED = "muscles can hold the pose as it is"
    CORRECTED = "digits were opened until muscles can hold them"
    TOO_STRONG_WHEN_OPEN = "a digit bears too much even opened as far as it may: move the hand or the object"
    TOO_MANY_SOLVES = "not found within the solves allowed; the best pose so far is given"
    NO_SOLUTION = "contact could not be solved at the corrected angles"


@dataclass(frozen=True, eq=False)
class Corrected:
    """A corrected pose.

    Attributes:
        status: How it ended.
        angles: Joint angles [rad], shape (J, 4).
        effort: The effort there, None where contact was not solved.
        opened: Digit → how far each of its joints was opened [rad], shape (3,).
        solves: Contact solutions it took.
    """

    status: Correction
    angles: NDArray[np.float64]
    effort: Effort | None
    opened: dict[str, NDArray[np.float64]]
    solves: int


def correct_angles(
    solve: Callable[[NDArray[np.float64]], Effort | None],
    skeleton: Skeleton,
    angles: NDArray[np.float64],
    open_angles: NDArray[np.float64],
    *,
    aim: float = 1.0,
    tolerance: float = 0.05,
    solves: int = 12,
) -> Corrected:
    """Open the digits that bear too much until each bears ``aim`` of its limit, or a little less.

    A digit opens along the way back to its open posture. All digits are corrected in the same solves; each one's
    way is found by the secant rule inside a bracket, so the loop ends.

    Args:
        solve: Effort at joint angles (J, 4), or None where contact could not be solved there.
        skeleton: The skeleton.
        angles: Wanted joint angles [rad], shape (J, 4).
        open_angles: Where digits open to, as before the hand closed, shape (J, 4).
        aim: Share of the limits that digits may reach.
        tolerance: How much below ``aim`` a corrected digit may be, as a share.
        solves: Contact solutions allowed.

    Raises:
        InputError: Angles of another shape, or an aim that is none.
    """
    if angles.shape != (len(skeleton), len(CHANNELS)) or open_angles.shape != angles.shape:
        raise InputError(f"angles: want shape ({len(skeleton)}, {len(CHANNELS)}), got {angles.shape}")
    if not 0.0 < aim <= 1.0 or not 0.0 < tolerance < 1.0:
        raise InputError(f"want 0 < aim ≤ 1 and 0 < tolerance < 1, got {aim} and {tolerance}")
    first = solve(angles)
    if first is None:
        return Corrected(Correction.NO_SOLUTION, angles.copy(), None, {}, 1)
    if first.share <= aim:
        return Corrected(Correction.NOT_NEEDED, angles.copy(), first, {}, 1)
    ways = {d.digit: _Way(d.share) for d in first.digits}
    best, at_best = None, angles.copy()
    trial, effort = angles, first
    for number in range(1, solves + 1):
        for digit in effort.digits:
            ways[digit.digit].seen(digit.share, aim)
        within = all(d.share <= aim for d in effort.digits)
        if within:
            best, at_best = effort, trial
            if all(w.done(tolerance, aim) for w in ways.values()):
                return _ended(Correction.CORRECTED, angles, at_best, best, skeleton, number)
        stuck = [w for w in ways.values() if w.low >= 1.0]
        if stuck:
            return _ended(Correction.TOO_STRONG_WHEN_OPEN, angles, trial, effort, skeleton, number)
        if number == solves:
            break
        trial = angles.copy()
        for digit in effort.digits:
            way = ways[digit.digit]
            way.step(aim * (1.0 - 0.5 * tolerance))
            joints = [skeleton.index(f"{digit.digit}.{k}") for k in _KNUCKLES]
            now, back = angles[joints, _FLEXION], np.minimum(open_angles[joints, _FLEXION], angles[joints, _FLEXION])
            trial[joints, _FLEXION] = now + way.at * (back - now)
        found = solve(trial)
        if found is None:
            return _ended(Correction.NO_SOLUTION, angles, trial, best, skeleton, number + 1)
        effort = found
    if best is not None:
        return _ended(Correction.CORRECTED, angles, at_best, best, skeleton, solves)
    return _ended(Correction.TOO_MANY_SOLVES, angles, trial, effort, skeleton, solves)


class _Way:
    """How far a digit is opened, 0 … 1, and the shares met so far."""

    def __init__(self, share: float) -> None:
        self.at = 0.0
        self.share = share
        self.before, self.before_share = -1.0, share  # the opening before that one
        self.low, self.low_share = -1.0, share  # the widest opening that was not enough
        self.high, self.high_share = 2.0, 0.0  # the smallest that was

    def seen(self, share: float, aim: float) -> None:
        """Narrow the bracket. Digits that push one another may contradict it: then it is opened again."""
        self.share = share
        if share > aim:
            if self.at >= self.high:
                self.high = 2.0
            if self.at > self.low:
                self.before, self.before_share = self.low, self.low_share
                self.low, self.low_share = self.at, share
        else:
            if self.at <= self.low:
                self.low = -1.0
            if self.at < self.high:
                self.high, self.high_share = self.at, share

    def done(self, tolerance: float, aim: float) -> bool:
        return self.high == 0.0 or self.share >= aim * (1.0 - tolerance) or self.high - max(self.low, 0.0) < 1e-3

    def step(self, wanted: float) -> None:
        if self.low < 0.0:
            self.at = 0.0
        elif self.high > 1.0:
            # Force rises ever faster from the first touch on, so a straight line through what is known opens too
            # little: half as much again.
            line = (self.low - self.before) / max(self.before_share - self.low_share, 1e-9)
            reach = 1.5 * (self.low_share - wanted) * line if self.before >= 0.0 else _FIRST
            self.at = min(1.0, self.low + float(np.clip(reach, _FIRST, 1.0)))
        else:
            steep = (self.high_share - self.low_share) / (self.high - self.low)
            guess = self.low + (wanted - self.low_share) / steep
            margin = 0.05 * (self.high - self.low)
            self.at = float(np.clip(guess, self.low + margin, self.high - margin))


def _ended(
    status: Correction,
    wanted: NDArray[np.float64],
    angles: NDArray[np.float64],
    effort: Effort | None,
    skeleton: Skeleton,
    solves: int,
) -> Corrected:
    opened = {}
    for digit in effort.digits if effort is not None else ():
        joints = [skeleton.index(f"{digit.digit}.{k}") for k in _KNUCKLES]
        by = wanted[joints, _FLEXION] - angles[joints, _FLEXION]
        if by.any():
            opened[digit.digit] = by
    return Corrected(status, angles, effort, opened, solves)
