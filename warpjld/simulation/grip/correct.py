"""Automatic correction of joint angles: digits are opened until their muscles can hold them (R120)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.muscles import KNUCKLES, Effort
from warpjld.simulation.grip.bracket import Bracket
from warpjld.skeleton.channels import FLEXION
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["CorrectedPose", "Correction", "Slopes", "correct_angles"]

_FIRST = 0.04
"""First opening that is tried without a slope, as a fraction of the way to the open posture."""
_NARROW = 1e-3
"""Width of the bracket, as a fraction of that way, at which the search ends."""

Slopes = Callable[[NDArray[np.float64], Mapping[str, NDArray[np.float64]]], Mapping[str, float] | None]
"""Solved angles (J, 4) and a direction (J, 4) by digit → derivative of each digit's load share along it; None if not
known."""


class Correction(Enum):
    """How a correction ended; the value is the message."""

    NOT_NEEDED = "muscles can hold the pose as it is"
    CORRECTED = "digits were opened until muscles can hold them"
    TOO_STRONG_WHEN_OPEN = "a digit bears too much even opened as far as it may: move the hand or the object"
    TOO_MANY_SOLVES = "not found within the solves allowed; the best pose so far is given"
    NO_SOLUTION = "contact could not be solved at the corrected angles"


@dataclass(frozen=True, eq=False)
class CorrectedPose:
    """A corrected pose.

    Attributes:
        status: How the correction ended.
        angles: Joint angles [rad], shape (J, 4).
        effort: Effort of the muscles there; None if contact was not solved.
        opened: Digit → angles by which its joints were opened [rad], shape (3,).
        solves: Number of contact solutions.
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
    slopes: Slopes | None = None,
) -> CorrectedPose:
    """Open the digits that exceed their limits until each bears ``aim`` of its limit, or a little less.

    A digit opens along the line from its angles to its open posture. All digits are corrected in the same solves; the
    position of each is found by a ``Bracket``.

    Args:
        solve: Effort at joint angles (J, 4); None if contact could not be solved there.
        skeleton: The skeleton.
        angles: Joint angles to correct [rad], shape (J, 4).
        open_angles: Angles to open towards, as before the hand closed [rad], shape (J, 4).
        aim: Load share (load over limit) that digits may reach.
        tolerance: How far below ``aim`` a corrected digit may be, relative to ``aim``.
        solves: Most contact solutions.
        slopes: Derivatives of load shares, where known.

    Raises:
        InputError: Angles of the wrong shape, or ``aim`` or ``tolerance`` out of range.
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
        digits.note(effort, None if slopes is None else slopes(trial, digits.directions))
        if all(d.share <= aim for d in effort.digits):
            best, at_best = effort, trial
            if digits.done:
                return _ended(Correction.CORRECTED, angles, at_best, best, skeleton, number)
        if digits.stuck:
            return _ended(Correction.TOO_STRONG_WHEN_OPEN, angles, trial, effort, skeleton, number)
        if number == solves:
            break
        trial = digits.opened()
        found = solve(trial)
        if found is None:
            return _ended(Correction.NO_SOLUTION, angles, trial, best, skeleton, number + 1)
        effort = found
    if best is not None:
        return _ended(Correction.CORRECTED, angles, at_best, best, skeleton, solves)
    return _ended(Correction.TOO_MANY_SOLVES, angles, trial, effort, skeleton, solves)


class _Digits:
    """Searches for the opening of all digits of a hand, made in common solves."""

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
        wanted = aim * (1.0 - 0.5 * tolerance)
        self._closings = {digit.digit: _Closing(wanted) for digit in first.digits}

    @property
    def directions(self) -> dict[str, NDArray[np.float64]]:
        """Change of the angles as each digit closes from its open posture, per closing 0 … 1, shape (J, 4)."""
        out = {}
        for digit in self._closings:
            joints, now, back = self._ends(digit)
            out[digit] = np.zeros_like(self._angles)
            out[digit][joints, FLEXION] = now - back
        return out

    def note(self, effort: Effort, slopes: Mapping[str, float] | None) -> None:
        """Record the load shares of the digits at their current closings."""
        for digit in effort.digits:
            slope = None if slopes is None else slopes.get(digit.digit)
            self._closings[digit.digit].note(digit.share, slope, self._aim)

    @property
    def done(self) -> bool:
        """Whether no digit is opened more than necessary."""
        return all(one.done(self._tolerance, self._aim) for one in self._closings.values())

    @property
    def stuck(self) -> bool:
        """Whether a digit exceeds its limit although it is completely open."""
        return any(one.stuck for one in self._closings.values())

    def opened(self) -> NDArray[np.float64]:
        """Angles to try next [rad], shape (J, 4)."""
        trial = self._angles.copy()
        for digit, closing in self._closings.items():
            joints, now, back = self._ends(digit)
            trial[joints, FLEXION] = back + closing.next() * (now - back)
        return trial

    def _ends(self, digit: str) -> tuple[list[int], NDArray[np.float64], NDArray[np.float64]]:
        """A digit's joints, their given flexions, and those of the open posture [rad]."""
        joints = [self._skeleton.index(f"{digit}.{k}") for k in KNUCKLES]
        now = self._angles[joints, FLEXION]
        return joints, now, np.minimum(self._open[joints, FLEXION], now)


class _Closing:
    """Search for the closing of one digit between open posture (0) and given angles (1)."""

    def __init__(self, wanted: float) -> None:
        self.at, self.share = 1.0, 0.0
        self._bracket = Bracket(0.0, 1.0, wanted, _FIRST)

    def note(self, share: float, slope: float | None, aim: float) -> None:
        self.share = share
        self._bracket.note(self.at, share, slope, enough=share > aim)

    @property
    def stuck(self) -> bool:
        above = self._bracket.above
        return above is not None and above.grip <= 0.0

    def done(self, tolerance: float, aim: float) -> bool:
        above, below = self._bracket.above, self._bracket.below
        if above is None:  # never above its limit
            return below is not None and below.grip >= 1.0
        return aim * (1.0 - tolerance) <= self.share <= aim or self._bracket.width < _NARROW

    def next(self) -> float:
        if self._bracket.above is not None:
            ahead = self._bracket.next()
            self.at = self.at if ahead is None else ahead
        return self.at


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
