"""Opening digits until muscles can hold them: bones' positions corrected automatically (R120)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.grip.bracket import clipped_inside
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["FLEXION", "KNUCKLES", "CorrectedPose", "Correction", "correct_angles"]

FLEXION = CHANNELS.index("flexion")
"""Column of the angles."""
KNUCKLES = ("base", "knuckle2", "knuckle3")
"""Joints of a digit that open."""
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
class CorrectedPose:
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
) -> CorrectedPose:
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
        return CorrectedPose(Correction.NO_SOLUTION, angles.copy(), None, {}, 1)
    if first.share <= aim:
        return CorrectedPose(Correction.NOT_NEEDED, angles.copy(), first, {}, 1)
    digits = _Digits(skeleton, angles, open_angles, first, aim, tolerance)
    best, at_best = None, angles.copy()
    trial, effort = angles, first
    for number in range(1, solves + 1):
        digits.note(effort)
        if all(d.share <= aim for d in effort.digits):
            best, at_best = effort, trial
            if digits.done:
                return _ended(Correction.CORRECTED, angles, at_best, best, skeleton, number)
        if digits.stuck:
            return _ended(Correction.TOO_STRONG_WHEN_OPEN, angles, trial, effort, skeleton, number)
        if number == solves:
            break
        trial = digits.opened(effort)
        found = solve(trial)
        if found is None:
            return _ended(Correction.NO_SOLUTION, angles, trial, best, skeleton, number + 1)
        effort = found
    if best is not None:
        return _ended(Correction.CORRECTED, angles, at_best, best, skeleton, solves)
    return _ended(Correction.TOO_MANY_SOLVES, angles, trial, effort, skeleton, solves)


class _Digits:
    """All digits of a hand on their ways back to where they open to."""

    def __init__(
        self,
        skeleton: Skeleton,
        angles: NDArray[np.float64],
        open_angles: NDArray[np.float64],
        first: Effort,
        aim: float,
        tolerance: float,
    ) -> None:
        self._skeleton, self._angles, self._open = skeleton, angles, open_angles
        self._aim, self._tolerance = aim, tolerance
        self._ways = {digit.digit: _Way(digit.share) for digit in first.digits}

    def note(self, effort: Effort) -> None:
        """Take note of what digits bear where they are."""
        for digit in effort.digits:
            self._ways[digit.digit].seen(digit.share, self._aim)

    @property
    def done(self) -> bool:
        """Whether none needs to be opened by less."""
        return all(way.done(self._tolerance, self._aim) for way in self._ways.values())

    @property
    def stuck(self) -> bool:
        """Whether one cannot be opened farther."""
        return any(way.low >= 1.0 for way in self._ways.values())

    def opened(self, effort: Effort) -> NDArray[np.float64]:
        """The angles to try next, shape (J, 4)."""
        trial, column = self._angles.copy(), FLEXION
        for digit in effort.digits:
            way = self._ways[digit.digit]
            way.step(self._aim * (1.0 - 0.5 * self._tolerance))
            joints = [self._skeleton.index(f"{digit.digit}.{k}") for k in KNUCKLES]
            now = self._angles[joints, column]
            back = np.minimum(self._open[joints, column], now)
            trial[joints, column] = now + way.at * (back - now)
        return trial


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
            self.at = clipped_inside(guess, self.low, self.high, 0.05)


def _ended(
    status: Correction,
    wanted: NDArray[np.float64],
    angles: NDArray[np.float64],
    effort: Effort | None,
    skeleton: Skeleton,
    solves: int,
) -> CorrectedPose:
    opened = {}
    for digit in effort.digits if effort is not None else ():
        joints = [skeleton.index(f"{digit.digit}.{k}") for k in KNUCKLES]
        by = wanted[joints, FLEXION] - angles[joints, FLEXION]
        if by.any():
            opened[digit.digit] = by
    return CorrectedPose(status, angles, effort, opened, solves)
