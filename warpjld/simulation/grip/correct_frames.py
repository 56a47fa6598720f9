"""Digits opened at frames where they bear more than their muscles can (R120)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactSolution
from warpjld.simulation.grip.correct import Corrected, Correction, correct_angles
from warpjld.fem.hand.muscles import JOINT_WORDS, DigitEffort, Effort
from warpjld.simulation.bodies.model import Bodies
from warpjld.simulation.solve.branch import detour
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.bodies.flesh_body import HandBody
from warpjld.skeleton.tree import CHANNELS

__all__ = ["Mended", "Mending"]

_FLEXION = CHANNELS.index("flexion")
_KNUCKLES = ("base", "knuckle2", "knuckle3")
_TRAVEL = 5e-4
"""Way of a joint in one step [m]."""


@dataclass(frozen=True)
class Mended:
    """One digit at one frame.

    Attributes:
        actor: Whose.
        frame: Number.
        digit: As ``left.index``.
        before, after: What it bore, and bears [N].
        limit: Largest force [N].
        opened: By how much its joints were opened [rad].
        status: Name of how the correction of the frame ended.
    """

    actor: str
    frame: float
    digit: str
    before: float
    after: float
    limit: float
    opened: tuple[float, float, float]
    status: str

    @property
    def text(self) -> str:
        """``index 71 N of 59 N at frame 36; opened knuckle 2 by 3.2° for 57 N``."""
        by = [f"{word} by {math.degrees(a):.1f}°" for word, a in zip(JOINT_WORDS, self.opened, strict=True) if a > 1e-6]
        out = f"{self.actor} {self.digit.rpartition('.')[2]} {self.before:.3g} N of {self.limit:.3g} N"
        return f"{out} at frame {self.frame:g}; opened {', '.join(by) or 'nothing'} for {self.after:.3g} N"


class Mending:
    """Corrections, frame after frame.

    Args:
        bodies: Everything.
        limits: Largest forces of digits [N], by actor and digit, where they are not the default.
        write: Told an actor's name, a time before and a time, and new flexions [rad] of joints at the latter: keys.
        aim: Share of their limits that digits may reach.
    """

    def __init__(
        self,
        bodies: Bodies,
        limits: Mapping[str, Mapping[str, float]],
        write: Callable[[str, float, float, dict[int, float]], None],
        *,
        aim: float = 1.0,
    ) -> None:
        self._bodies, self._limits, self._write, self._aim = bodies, limits, write, aim
        self.done: list[Mended] = []
        self.failed: list[str] = []

    @property
    def worst(self) -> list[Mended]:
        """Of every digit the frame at which it bore most before."""
        out: dict[tuple[str, str], Mended] = {}
        for one in self.done:
            place = (one.actor, one.digit)
            if place not in out or one.before > out[place].before:
                out[place] = one
        return list(out.values())

    def __call__(self, before: ContactSolution, found: ContactSolution) -> ContactSolution:
        """The equilibrium at the corrected angles, or the one found where nothing has to be."""
        for hand in self._bodies.hands:
            if hand.drive.bendable:
                found = self._hand(hand, before, found)
        return found

    def _hand(self, hand: HandBody, before: ContactSolution, found: ContactSolution) -> ContactSolution:
        drive = hand.drive
        assert drive.angles is not None
        time, since = found.last.time, before.last.time
        wanted, then, opened = drive.angles(time), drive.angles(since), drive.angles(0.0)
        first = self._effort(hand, wanted, found)
        if first.share <= self._aim:
            return found
        tried: list[tuple[NDArray[np.float64], ContactSolution]] = [(wanted, found)]

        def solve(angles: NDArray[np.float64]) -> Effort | None:
            if np.array_equal(angles, wanted):
                return first
            solution = self._at(hand, before, then, angles, time - since)
            if not solution.converged:
                return None
            tried.append((angles.copy(), solution))
            return self._effort(hand, angles, solution)

        corrected = correct_angles(solve, drive.skeleton, wanted, opened, aim=self._aim)
        chosen = [solution for angles, solution in tried if np.array_equal(angles, corrected.angles)]
        frame = self._bodies.start + time
        if corrected.status is not Correction.CORRECTED or not chosen:
            self.failed.append(f"{hand.name} at frame {frame:g}: {corrected.status.value}")
            return found
        self._note(hand, frame, first, corrected)
        changed = {}
        for name in corrected.opened:
            for knuckle in _KNUCKLES:
                joint = drive.skeleton.index(f"{name}.{knuckle}")
                changed[joint] = float(corrected.angles[joint, _FLEXION])
        self._write(hand.name, since, time, changed)
        drive.changed()
        return chosen[-1]

    def _note(self, hand: HandBody, frame: float, first: Effort, corrected: Corrected) -> None:
        assert corrected.effort is not None
        for name, by in corrected.opened.items():
            was: DigitEffort = first[name]
            now = corrected.effort[name]
            opened = (float(by[0]), float(by[1]), float(by[2]))
            self.done.append(
                Mended(hand.name, frame, name, was.force, now.force, was.limit, opened, corrected.status.name)
            )

    def _at(
        self,
        hand: HandBody,
        before: ContactSolution,
        then: NDArray[np.float64],
        angles: NDArray[np.float64],
        duration: float,
    ) -> ContactSolution:
        drive, since = hand.drive, before.last.time
        assert drive.posed is not None
        ends = [drive.posed(a, since + t).positions[0] for a, t in ((then, 0.0), (angles, duration))]
        far = float(np.linalg.norm(ends[1] - ends[0], axis=1).max())
        return detour(
            self._bodies,
            before,
            max(1, int(np.ceil(far / _TRAVEL))),
            moves=(
                hand.name,
                lambda share: drive.moves_of(then + share * (angles - then), since + share * duration),
            ),
            duration=duration,
        )

    def _effort(self, hand: HandBody, angles: NDArray[np.float64], solution: ContactSolution) -> Effort:
        assert hand.drive.posed is not None
        poses = hand.drive.posed(angles, solution.last.time)
        return effort_at(self._bodies, hand, poses, solution.last, self._limits.get(hand.name))
