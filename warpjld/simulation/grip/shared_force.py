"""Search for the closing of each digit at which all use the same share of their muscles, and press with a total force.

Model: the flexors of all digits are activated alike, as in a whole grip; what each digit presses with follows from its
strength and from where on it the object lies (its lever arms). With the share s_d and the force f_d of digit d at the
closings g, the wanted share is a = F / Σ f_d / s_d, which changes little from trial to trial: f_d / s_d is the force at
which a digit's muscles reach their limits. Newton's method on s_d(g) = a then takes few trials; as forces of flesh
stiffen, steps follow ``warpjld.fem.hand.stiffening`` instead of a straight line. Where equal shares are impossible, as
on a free object that the thumb alone opposes, steps are those of least squares, in which the total counts more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.stiffening import ForceSlope, way_to
from warpjld.simulation.grip.force import ForceStatus
from warpjld.simulation.grip.pressed_digits import PressedDigits

__all__ = ["SAME_CLOSING", "SharedGrip", "share_force"]

Array = NDArray[np.float64]

_ROUNDS = 16
"""Most trials; five or six are enough where all digits touch already."""
_LOST = 3
"""Trials without an equilibrium after which the search ends."""
_IDLE = 3
"""Trials with the total force that do not come nearer to equal shares, after which they count as impossible."""
_NEARER = 0.9
"""Unevenness relative to the best so far below which a trial has come nearer."""
_TOUCHES = 0.01
"""Share above which a digit presses, relative to that at which all would have the total: flesh between two digits
transmits a little to both."""
_POWER = 2.0
"""Assumed exponent of a share's growth since first contact, until two slopes are known (as in ``Bracket``)."""
_FARTHEST = 4.0
"""Longest step of a digit that presses, over the first step; it doubles while a digit keeps on reaching it: what it
presses on gives way, as a neighbour does."""
_TOTAL = 30.0
"""Weight of the total force in least squares, beside each digit's share: nearly a constraint."""
_GRAZES = 0.1
"""Share relative to the wanted one from which a digit presses on the object, not on a neighbour alone."""
_SLIPS = 0.5
"""The same below which a digit that presses less as it closes on slips off the object."""
_STILL = 0.2
"""Largest closing of all others, relative to that digit's own, that does not explain it."""
_PAST = 8.0
"""Closing beyond where a digit should touch, over the first step, after which one that does not even graze passes by
what it should press on: 5 mm of a fingertip with steps of half a degree, where flesh would press with several N."""
_KEPT, _TOLD = (0.2, 2.0), 0.05
"""Bounds of the rise of a digit's share in the last step over the rise that slopes promised, and promised rise over the
share from which on it is told by that: a thumb that slid along a can rose by half of what was promised."""
_SLIGHT = 0.25
"""Force of a digit, over the mean of all, below which its unevenness counts for less: in proportion."""
_SINGULAR = 1e4
"""Condition number above which the digits cannot press apart from one another."""
SAME_CLOSING = 1e-9
"""Tolerance for equal closings [rad]."""


@dataclass(frozen=True, eq=False)
class SharedGrip:
    """The closings found, or those tried that came nearest.

    Attributes:
        status: How the search ended.
        grips: Closing of each digit, shape (D,).
        pressed: Forces there; None if nothing was solved.
        left_out: Digits that press on nothing, or less than their share, as far as they may bend, or that slip off.
        trials: Every trial, in order.
    """

    status: ForceStatus
    grips: Array
    pressed: PressedDigits | None
    left_out: tuple[int, ...]
    trials: tuple[tuple[Array, PressedDigits], ...]


def share_force(
    press: Callable[[Array], PressedDigits | None],
    low: Sequence[float] | Array,
    high: Sequence[float] | Array,
    strengths: Sequence[float] | Array,
    force: float,
    *,
    start: float,
    tolerance: float = 0.02,
    even: float = 0.05,
    begin: Array | None = None,
    touch: Array | None = None,
    exhausted: Callable[[], bool] = lambda: False,
) -> SharedGrip:
    """Find closings from 0 on at which the digits' shares are equal and their forces sum to ``force``.

    Args:
        press: Forces at closings (D,); None if contact could not be solved.
        low, high: Range of each digit's closing, with 0 in it, shape (D,).
        strengths: Largest force of each digit, assumed for those that do not press yet [N], shape (D,).
        force: Target for the sum of the forces [N].
        start: First step of a digit that does not press.
        tolerance: Relative tolerance of the sum.
        even: Largest difference of a share from the mean of the shares, relative to it.
        begin: Closings of the first trial, shape (D,); 0 by default.
        touch: Closings at which the digits are expected to touch first, shape (D,): one that does not press yet goes
            there in one step; by default nothing is expected.
        exhausted: Whether nothing more may be solved.

    Raises:
        InputError: Ranges that do not contain 0, a force, strength or step that is not above 0.
    """
    bounds, most = [np.asarray(end, dtype=np.float64) for end in (low, high)], np.asarray(strengths, dtype=np.float64)
    search = _Search(bounds[0], bounds[1], most, force, start, np.full(len(most), np.nan) if touch is None else touch)
    if not (len(search.low) and (search.low <= 0.0).all() and (search.high >= 0.0).all()):
        raise InputError(f"grip: want digits that may close from 0 on, got ranges {search.low} to {search.high}")
    if not (force > 0.0 and np.isfinite(force) and start > 0.0 and (search.strengths > 0.0).all()):
        raise InputError(f"grip: want force, strengths and step above 0, got {force}, {search.strengths}, {start}")
    grips, lost = np.zeros(len(search.low)) if begin is None else np.clip(begin, search.low, search.high), 0
    for _ in range(_ROUNDS):
        try:
            found = press(grips.copy())
        except KeyboardInterrupt:
            return search.ended(ForceStatus.INTERRUPTED, tolerance)
        if found is None:
            lost += 1
            if lost >= _LOST or exhausted() or not search.trials:
                break
            grips = 0.5 * (grips + search.trials[-1][0])
            continue
        search.trials.append((grips, found))
        status = search.status(tolerance, even)
        if status is not None:
            return search.ended(status, tolerance)
        ahead = search.next()
        if np.abs(ahead - grips).max() < SAME_CLOSING:
            break
        grips = ahead
    reached = any(search.sums_up(found, tolerance) for _, found in search.trials)
    if reached:
        return search.ended(ForceStatus.UNEVEN, tolerance)
    return search.ended(ForceStatus.EXHAUSTED if exhausted() else ForceStatus.NO_SOLUTION, tolerance)


class _Search:
    """State of a search: its trials, and the steps of digits that do not press yet."""

    def __init__(self, low: Array, high: Array, strengths: Array, force: float, start: float, touch: Array) -> None:
        self.low, self.high, self.strengths, self.force, self.start = low, high, strengths, force, start
        self._touch = touch
        self.trials: list[tuple[Array, PressedDigits]] = []
        self._reach, self._most = np.full(len(low), start), np.full(len(low), _FARTHEST * start)
        self._best, self._idle = np.inf, 0
        self._slipped = np.zeros(len(low), dtype=bool)

    def pressing(self, found: PressedDigits) -> NDArray[np.bool_]:
        """Which digits press."""
        return np.asarray(found.shares > _TOUCHES * self.force / self.strengths.sum())

    def wanted(self, grips: Array, found: PressedDigits) -> tuple[float, NDArray[np.bool_]]:
        """Wanted share, and which digits can have it: all but those that have less as far as they may bend, or more
        as far as they may open, or that slip off."""
        pressing = self.pressing(found)
        able = ~self._slipped
        at = np.where(pressing, found.forces / np.where(pressing, found.shares, 1.0), self.strengths)
        share = 0.0
        for _ in range(len(grips) + 1):  # terminates: every round takes out a digit
            left = self.force - float(found.forces[~able].sum())
            share = max(left, 0.0) / float(at[able].sum()) if able.any() else 0.0
            spent = (grips >= self.high - SAME_CLOSING) & (found.shares < share)
            open_ = (grips <= self.low + SAME_CLOSING) & (found.shares > share)
            if not (able & (spent | open_)).any():
                break
            able &= ~(spent | open_)
        return share, able

    def sums_up(self, found: PressedDigits, tolerance: float) -> bool:
        """Whether the forces have the wanted sum."""
        return abs(float(found.forces.sum()) - self.force) <= tolerance * self.force

    def unevenness(self, grips: Array, found: PressedDigits) -> float:
        """Largest relative difference of the able digits' shares from their mean, which counts less for digits that
        are to press slightly; infinite without such digits."""
        able = self.wanted(grips, found)[1]
        shares, counts = found.shares[able], np.minimum(self.strengths / (_SLIGHT * self.strengths.mean()), 1.0)[able]
        mean = float(shares @ counts / counts.sum()) if len(shares) else 0.0
        return float((counts * np.abs(shares / mean - 1.0)).max()) if mean > 0.0 else np.inf

    def status(self, tolerance: float, even: float) -> ForceStatus | None:
        """Status with which the last trial ends the search; None to continue."""
        grips, found = self.trials[-1]
        self._note_slips()
        _, able = self.wanted(grips, found)
        total = float(found.forces.sum())
        if self.sums_up(found, tolerance):
            uneven = self.unevenness(grips, found)
            if uneven <= even:
                return ForceStatus.REACHED if found.strain <= 1.0 else ForceStatus.TOO_WEAK
            self._idle = 0 if uneven < _NEARER * self._best else self._idle + 1
            self._best = min(self._best, uneven)
            if self._idle >= _IDLE:
                return ForceStatus.UNEVEN
        if not able.any():
            if total > self.force:
                return ForceStatus.HARDER_ALREADY
            return ForceStatus.LIMIT if total > 0.0 else ForceStatus.NO_CONTACT
        if min(found.shares[able].min(), found.strain) > 1.0 and total < self.force:
            return ForceStatus.TOO_WEAK
        return None

    def _note_slips(self) -> None:
        """Find digits that press less than before because they closed on: past the end of the object, or round it; and
        those that are long past where they should touch."""
        grips, found = self.trials[-1]
        share, able = self.wanted(grips, found)
        past = grips - self._touch >= _PAST * self.start
        self._slipped |= able & past & (found.shares < _GRAZES * share)
        if len(self.trials) < 2:
            return
        before, pressed = self.trials[-2]
        moved = grips - before
        for d in np.flatnonzero(able & (moved >= self.start) & (found.shares < pressed.shares)).tolist():
            alone = np.abs(np.delete(moved, d)).max(initial=0.0) <= _STILL * moved[d]
            most = max(float(known.shares[d]) for _, known in self.trials)
            self._slipped[d] = alone and _GRAZES * share <= most <= _SLIPS * share

    def next(self) -> Array:
        """Closings of the next trial."""
        grips, found = self.trials[-1]
        share, able = self.wanted(grips, found)
        step = np.zeros(len(grips))
        for d in np.flatnonzero(self._slipped).tolist():  # back to where it pressed most
            step[d] = max(self.trials, key=lambda one: float(one[1].shares[d]))[0][d] - grips[d]
        pressing = able & self.pressing(found)
        for d in np.flatnonzero(able & ~pressing).tolist():
            step[d] = self._toward(d)
        if pressing.any():
            step[pressing] = self._newton(np.flatnonzero(pressing), share, step)
        return np.clip(grips + step, self.low, self.high)

    def _toward(self, d: int) -> float:
        """Step of a digit that does not press: half-way to a closing at which it did, else to just beyond where it
        should touch, else twice the step before."""
        here = self.trials[-1][0][d]
        pressed = [grips[d] for grips, found in self.trials if self.pressing(found)[d] and grips[d] > here]
        if pressed:
            return 0.5 * float(min(pressed) - here)
        if here < self._touch[d]:
            return float(self._touch[d] - here) + self.start
        step, self._reach[d] = self._reach[d], 2.0 * self._reach[d]
        return float(step)

    def _newton(self, digits: NDArray[np.intp], share: float, others: Array) -> Array:
        """Steps of pressing digits to a share while others move; to the total and the nearest shares where all together
        decide what each presses with."""
        found = self.trials[-1][1]
        slopes = self._slopes(digits)
        ways = np.array([self._way(d, slopes[k, k], share) for k, d in enumerate(digits)])
        missing = np.diagonal(slopes) * ways
        if found.slopes is not None:
            missing -= (self._kept()[:, None] * found.slopes)[digits] @ others
        if np.linalg.cond(slopes / np.diagonal(slopes)) < _SINGULAR:
            step = np.linalg.solve(slopes, missing)
        else:
            at = found.forces[digits] / found.shares[digits]
            total = share * float(at.sum()) - float(found.forces[digits].sum())
            matrix = np.vstack([slopes / share, _TOTAL * (at @ slopes) / self.force])
            wanted = np.append(missing / share, _TOTAL * total / self.force)
            step = np.linalg.lstsq(matrix, wanted, rcond=1.0 / _SINGULAR)[0]
        most = self._most[digits]
        self._most[digits] = np.where(np.abs(step) > most, 2.0 * most, _FARTHEST * self.start)
        return np.asarray(np.clip(step, -most, most))

    def _way(self, d: int, slope: float, share: float) -> float:
        """Way of one digit to a share if no other moves; its trial before tells how it stiffens."""
        grips, found = self.trials[-1]
        now, other = ForceSlope(float(found.shares[d]), float(slope)), None
        for there, known in self.trials[-2::-1]:
            if known.slopes is not None and abs(there[d] - grips[d]) > SAME_CLOSING and self.pressing(known)[d]:
                if known.slopes[d, d] > 0.0 and found.slopes is not None:
                    other = ForceSlope(float(known.shares[d]), float(self._kept()[d] * known.slopes[d, d]))
                break
        return way_to(share, now, other, _POWER)

    def _slopes(self, digits: NDArray[np.intp]) -> Array:
        """Derivatives of the shares; where unknown, secants since an earlier trial, or those of a pad that first
        touched one step ago."""
        grips, found = self.trials[-1]
        if found.slopes is not None:
            out = (self._kept()[:, None] * found.slopes)[np.ix_(digits, digits)]
            if np.isfinite(out).all() and (np.diagonal(out) > 0.0).all():
                return np.asarray(out)
        out = np.diag(_POWER * found.shares[digits] / self.start)
        for k, d in enumerate(digits):
            for there, known in self.trials[-2::-1]:
                rise, apart = found.shares[d] - known.shares[d], grips[d] - there[d]
                if rise * apart > 0.0 and known.shares[d] > 0.0:
                    out[k, k] = rise / apart
                    break
        return np.asarray(out)

    def _kept(self) -> Array:
        """Rise of each digit's share in the last step, over that promised by the slopes at both ends of it, (D,); 1 for
        those that did not press before, or of which little was promised."""
        out = np.ones(len(self.low))
        if len(self.trials) < 2:
            return out
        (there, before), (here, now) = self.trials[-2:]
        if before.slopes is None or now.slopes is None:
            return out
        promised = 0.5 * (before.slopes + now.slopes) @ (here - there)
        told = self.pressing(before) & self.pressing(now) & (np.abs(promised) > _TOLD * now.shares)
        out[told] = np.clip((now.shares - before.shares)[told] / promised[told], *_KEPT)
        return out

    def ended(self, status: ForceStatus, tolerance: float) -> SharedGrip:
        """Result with the trial that came nearest: of those with the wanted sum, the most even one."""
        trials = tuple(self.trials)
        if not trials:
            return SharedGrip(status, np.zeros(len(self.low)), None, (), ())
        if status in (ForceStatus.REACHED, ForceStatus.LIMIT, ForceStatus.HARDER_ALREADY):
            best = trials[-1]
        else:
            able = [one for one in trials if one[1].strain <= 1.0] or [trials[0]]
            summed = [one for one in able if self.sums_up(one[1], tolerance)]
            if summed:
                best = min(summed, key=lambda one: self.unevenness(*one))
            else:
                best = min(able, key=lambda one: abs(float(one[1].forces.sum()) - self.force))
        left = np.flatnonzero(~self.wanted(*best)[1])
        return SharedGrip(status, best[0], best[1], tuple(left.tolist()), trials)
