"""Equilibria of a hand that closes further from a solved frame, all joints by the same angle (R123)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent
from warpjld.fem.contact.sensitivity.perturbation import Perturbation
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.bone_room import bone_room
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.sensitivity.parameters import angles_perturbed
from warpjld.simulation.solve.branch import solve_branch
from warpjld.skeleton.channels import FLEXION

__all__ = ["TRAVEL", "Squeeze"]

TRAVEL = 5e-4
"""Largest motion of a joint in one load step [m]: with longer ones Newton's method has trouble with friction."""

_EACH = 20
"""Linear solves that a load step of closing may take on average; found ones take 4 to 14."""
_SAME = 1e-9
"""Tolerance for equal grips [rad]."""


class Squeeze:
    """Equilibria by grip: the angle [rad] by which joints flex beyond their present flexion, each up to its limit.

    Args:
        model: The contact model.
        history: History at the initial equilibrium.
        hand: The hand that closes; it has to be driven by joint angles.
        joints: Indices of the joints that flex.
        after: Initial equilibrium.
        limits: Digit → force limit that differs from the default [N].
        budget: Linear solves that the search may take; by default without a bound.

    Attributes:
        model, history, hand, limits: As given.
        first: Initial equilibrium.
        time: Time of the initial equilibrium [frames].
        budget: Linear solves so far, and left.
    """

    def __init__(
        self,
        model: ContactModel,
        history: History,
        hand: FleshBody,
        joints: Sequence[int],
        after: ContactSolution,
        limits: Mapping[str, float] | None = None,
        budget: SearchBudget | None = None,
    ) -> None:
        self.model, self.history, self.hand = model, history, hand
        self._joints, self.limits = list(joints), limits
        self._start = hand.bones.angles(after.last.time)
        self._high = np.asarray(hand.bones.skeleton.limits[self._joints, FLEXION, 1])
        self.time, self.budget = after.last.time, budget or SearchBudget(None)
        self.first = after
        self._closed: dict[float, ContactSolution] = {0.0: after}
        self._failed: dict[float, ContactSolution] = {}

    @property
    def room(self) -> float:
        """Grip at which the last joint reaches its limit, or the bone of its digit an object [rad]."""
        return float((self._high - self._start[self._joints, FLEXION]).max(initial=0.0))

    @property
    def known(self) -> list[float]:
        """Grips whose equilibria were found, ascending [rad]."""
        return sorted(self._closed)

    def angles(self, grip: float) -> NDArray[np.float64]:
        """Joint angles at a grip [rad], shape (J, 4)."""
        out = self._start.copy()
        now = out[self._joints, FLEXION]
        out[self._joints, FLEXION] = np.maximum(now, np.minimum(now + grip, self._high))
        return out

    def closed(self, grip: float) -> ContactSolution:
        """Equilibrium at a grip, reached from the largest known one below it; its status tells whether it was found."""
        if grip in self._closed or grip in self._failed:
            return self._closed.get(grip) or self._failed[grip]
        before = max(known for known in self._closed if known <= grip + _SAME)

        steps, closing = self.steps(before, grip, TRAVEL), self.closes(before, grip)
        most = self.budget.trial(_EACH * steps)
        found = solve_branch(
            self.model, self.history, self._closed[before], steps, moves=closing, solves=most, ease=True
        )
        self.budget.counted(found)
        (self._closed if found.converged else self._failed)[grip] = found
        return found

    def toward(self, grip: float) -> Iterator[tuple[float, ContactSolution]]:
        """Grips and equilibria, one for every load step, from the largest known one below a grip to that grip [rad];
        they end before it where none is found."""
        at = max(known for known in self._closed if known <= grip + _SAME)
        if grip - at <= _SAME:
            yield grip, self._closed[at]
            return
        steps = self.steps(at, grip, TRAVEL)
        for ahead in (at + (grip - at) * (k + 1) / steps for k in range(steps - 1)):
            if self.budget.exhausted or not self.closed(ahead).converged:
                return
            yield ahead, self._closed[ahead]
        if not self.budget.exhausted and self.closed(grip).converged:
            yield grip, self._closed[grip]

    def closes(self, before: float, grip: float) -> tuple[str, Callable[[float], Moves]]:
        """Bone motion of a branch on which the hand closes from one grip to another."""

        def moves(share: float) -> Moves:
            return self.hand.bones.moves_of(self.angles(before + share * (grip - before)), self.time)

        return self.hand.name, moves

    def steps(self, before: float, grip: float, travel: float) -> int:
        """Number of steps between two grips in which no joint moves farther than ``travel`` [m]."""
        return self.hand.bones.steps([(self.angles(end), self.time) for end in (before, grip)], travel)

    def tangent(self, grip: float, closed: ContactSolution) -> tuple[EquilibriumTangent, Perturbation]:
        """Tangent of the equilibrium at a grip, and the perturbation of the bones per rad of grip.

        Raises:
            SensitivityError: The equilibrium has no derivative.
        """
        model, time = self.model, self.time
        known = model.prescribed(time, self.history).degrees
        change = angles_perturbed(model, self.hand, self.angles(grip), time, self.along(grip))
        return EquilibriumTangent(model.body, model.pairs, closed, known, steadied=True), change

    def along(self, grip: float) -> NDArray[np.float64]:
        """Derivative of the angles with respect to the grip, shape (J, 4); 0 for joints at their limits."""
        out = np.zeros_like(self._start)
        out[self._joints, FLEXION] = self._start[self._joints, FLEXION] + grip < self._high
        return out

    def stays(self, grip: float) -> tuple[str, Callable[[float], Moves]]:
        """Bone motion of a branch on which the hand stays at a grip."""
        there = self.hand.bones.moves_of(self.angles(grip), self.time)
        return self.hand.name, lambda share: there

    def effort(self, grip: float, instant: ContactInstant) -> Effort:
        """Effort of the muscles at a grip."""
        poses = self.hand.bones.posed(self.angles(grip), self.time)
        return effort_at(self.model, self.hand, poses, instant, self.limits)

    def keep_bones_out(self, most: float) -> None:
        """Let no digit bend so far, up to a grip of ``most`` [rad], that its bones are inside an object."""
        room, names = bone_room(self.model, self.hand, self.time, self.angles, most), self.hand.bones.skeleton.names
        left = np.array([room.get(names[joint].split(".")[-2], np.inf) for joint in self._joints])
        self._high = np.minimum(self._high, self._start[self._joints, FLEXION] + left)
