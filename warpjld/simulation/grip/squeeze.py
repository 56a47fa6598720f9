"""A hand that closes on, joint by joint alike, from a frame that was solved (R123)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.bodies.model import Bodies
from warpjld.simulation.solve.branch import detour
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.bodies.flesh_body import HandBody
from warpjld.skeleton.tree import CHANNELS

__all__ = ["Tightening"]

_FLEXION = CHANNELS.index("flexion")
_TRAVEL = 5e-4
"""Way of the skin in one step [m]: longer ones make Newton's method stumble over friction."""

_SAME = 1e-9


class Tightening:
    """Grips: angles by which joints flex beyond where they are; each up to its limit.

    Args:
        bodies: Everything.
        hand: The hand that closes; its motion has angles.
        joints: Those that flex, as the skeleton numbers them.
        after: Equilibrium to begin at.
        limits: Digit → largest force [N], where it is not the default.
    """

    def __init__(
        self,
        bodies: Bodies,
        hand: HandBody,
        joints: Sequence[int],
        after: ContactSolution,
        limits: Mapping[str, float] | None = None,
    ) -> None:
        drive = hand.drive
        assert drive.angles is not None
        self.bodies, self.hand = bodies, hand
        self._joints, self._limits = list(joints), limits
        self._start = drive.angles(after.last.time)
        self._time = after.last.time
        self._closed: dict[float, ContactSolution] = {0.0: after}

    @property
    def room(self) -> float:
        """Grip at which the last joint comes to its limit [rad]."""
        high = self.hand.drive.skeleton.limits[self._joints, _FLEXION, 1]
        return float((high - self._start[self._joints, _FLEXION]).max(initial=0.0))

    def angles(self, grip: float) -> NDArray[np.float64]:
        """Joint angles at a grip [rad], shape (J, 4)."""
        out = self._start.copy()
        high = self.hand.drive.skeleton.limits[self._joints, _FLEXION, 1]
        now = out[self._joints, _FLEXION]
        out[self._joints, _FLEXION] = np.maximum(now, np.minimum(now + grip, high))
        return out

    def closed(self, grip: float) -> ContactSolution:
        """Equilibrium at a grip, gone to from the next gentler one that is known; its status says if it was found."""
        if grip in self._closed:
            return self._closed[grip]
        before = max(known for known in self._closed if known <= grip + _SAME)
        drive = self.hand.drive

        def on(share: float) -> Moves:
            return drive.moves_of(self.angles(before + share * (grip - before)), self._time)

        steps = self.steps(before, grip)
        found = detour(self.bodies, self._closed[before], steps, moves=(self.hand.name, on))
        if found.converged:
            self._closed[grip] = found
        return found

    def stays(self, grip: float) -> tuple[str, Callable[[float], Moves]]:
        """The hand as it is at a grip, for a detour."""
        there = self.hand.drive.moves_of(self.angles(grip), self._time)
        return self.hand.name, lambda share: there

    def steps(self, before: float, grip: float) -> int:
        """How many steps the skin's way takes."""
        drive = self.hand.drive
        assert drive.posed is not None
        ends = [drive.posed(self.angles(one), self._time).positions[0] for one in (before, grip)]
        return max(1, int(np.ceil(float(np.linalg.norm(ends[1] - ends[0], axis=1).max()) / _TRAVEL)))

    def effort(self, grip: float, instant: ContactInstant) -> Effort:
        """What the muscles do at a grip."""
        drive = self.hand.drive
        assert drive.posed is not None
        poses = drive.posed(self.angles(grip), self._time)
        return effort_at(self.bodies, self.hand, poses, instant, self._limits)
