"""Equilibria of a hand whose digits each close further by an angle of its own from a solved frame (R118, R123)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactInstant, ContactSolution
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, SensitivityError
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.muscles import Effort
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.bone_room import bone_room
from warpjld.simulation.grip.pressed_digits import PressedDigits
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.simulation.grip.shared_force import SAME_CLOSING
from warpjld.simulation.grip.squeeze import TRAVEL
from warpjld.simulation.grip.touch_room import touch_room
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.sensitivity.effort_slope import EffortTangent
from warpjld.simulation.sensitivity.parameters import angles_perturbed
from warpjld.simulation.solve.branch import solve_branch
from warpjld.skeleton import Poses
from warpjld.skeleton.channels import FLEXION

__all__ = ["DigitSqueeze"]

Array = NDArray[np.float64]

_BACK = 2
"""Load steps by which a digit may have been opened on the way to an equilibrium: searches end in small steps to and
fro, and every one that began from further back would close all digits anew."""


@dataclass(frozen=True, eq=False)
class _Known:
    """An equilibrium.

    Attributes:
        grips: Closing of each digit [rad], shape (D,).
        closed: The equilibrium.
        furthest: Largest closing of each digit on the way to it [rad], shape (D,).
        same: Whether digits that do not close are where they were at first.
    """

    grips: Array
    closed: ContactSolution
    furthest: Array
    same: bool = True


class DigitSqueeze:
    """Equilibria by the digits' closings: angles [rad] by which the joints of each flex beyond their present flexion,
    or extend if negative, each up to its limit.

    Args:
        model: The contact model.
        history: History at the initial equilibrium.
        hand: The hand that closes; it has to be driven by joint angles.
        joints: Digit, as in its efforts → indices of the joints that flex.
        after: Initial equilibrium.
        limits: Digit → force limit that differs from the default [N].
        budget: Linear solves that the search may take; by default without a bound.

    Attributes:
        model: As given.
        digits: Names of the digits that close, in the order of all arrays.
        joints: Joints of each.
        wanted: Force of each digit of which its share is measured [N], shape (D,); None: shares are those of muscles.
        solved: Equilibria solved so far, beside the initial one.
        bone_room: Digit, such as ``index`` → largest closing at which its bones are outside every object [rad], where
            that is below the largest that ``range`` was asked for.
        touch: Closing at which each digit touches first [rad], shape (D,), infinite for those that touch nothing;
            known once ``range`` was asked for.
    """

    def __init__(
        self,
        model: ContactModel,
        history: History,
        hand: FleshBody,
        joints: Mapping[str, Sequence[int]],
        after: ContactSolution,
        limits: Mapping[str, float] | None = None,
        budget: SearchBudget | None = None,
    ) -> None:
        self._budget = budget
        self.model, self._history, self._hand, self._limits = model, history, hand, limits
        self.wanted: Array | None = None
        self.digits, self.joints = tuple(joints), [list(one) for one in joints.values()]
        self._start, self._time = hand.bones.angles(after.last.time), after.last.time
        self._bounds = hand.bones.skeleton.limits[:, FLEXION]
        self._known = [_Known(np.zeros(len(self.digits)), after, np.zeros(len(self.digits)))]
        self.solved = 0
        self.bone_room: dict[str, float] = {}
        self.touch = np.zeros(len(self.digits))

    def range(self, most: float) -> tuple[Array, Array]:
        """Closings at which the last joint of each digit reaches its limit, or its bone an object [rad], each (D,).

        Args:
            most: Largest closing and opening [rad].
        """
        now = self._start[:, FLEXION]
        low = [float((self._bounds[one, 0] - now[one]).min()) for one in self.joints]
        high = [min(most, float((self._bounds[one, 1] - now[one]).max())) for one in self.joints]
        count = len(self.digits)
        self.bone_room = room = bone_room(
            self.model, self._hand, self._time, lambda by: self.angles(np.full(count, by)), max(high)
        )
        high = [min(one, room.get(name.rpartition(".")[2], most)) for name, one in zip(self.digits, high, strict=True)]
        after, names = self._known[0].closed.last.displacement, [digit.rpartition(".")[2] for digit in self.digits]
        touch = touch_room(
            self.model, self._hand, after, self._time, lambda by: self.angles(np.full(count, by)), max(high)
        )
        self.touch = np.array([touch.get(name, np.inf) for name in names])
        return np.clip(low, -most, 0.0), np.maximum(high, 0.0)

    def angles(self, grips: Array) -> Array:
        """Joint angles at closings (D,) [rad], shape (J, 4)."""
        out = self._start.copy()
        for joints, grip in zip(self.joints, grips, strict=True):
            now = out[joints, FLEXION]
            low, high = np.minimum(self._bounds[joints, 0], now), np.maximum(self._bounds[joints, 1], now)
            out[joints, FLEXION] = np.clip(now + grip, low, high)
        return out

    def press(self, grips: Array) -> PressedDigits | None:
        """Forces at closings (D,); None if contact could not be solved."""
        closed = self._closed(grips)
        if closed is None:
            return None
        effort = self.effort(grips, closed.last)
        mine = [effort[digit] for digit in self.digits]
        forces, shares = (np.array([getattr(one, name) for one in mine]) for name in ("force", "share"))
        load = float(shares.max())
        if self.wanted is not None:
            shares = forces / self.wanted
        slopes = self._slopes(grips, closed, effort) if closed.last.touches else None
        return PressedDigits(forces, shares, slopes, load)

    def effort(self, grips: Array, instant: ContactInstant) -> Effort:
        """Effort of the muscles at closings (D,)."""
        return effort_at(self.model, self._hand, self._posed(self.angles(grips)), instant, self._limits)

    def solved_at(self, grips: Array) -> ContactInstant | None:
        """The equilibrium at closings (D,); None if contact could not be solved."""
        closed = self._closed(grips)
        return None if closed is None else closed.last

    def known(self, grips: Array) -> ContactInstant | None:
        """The equilibrium at closings that were tried; None if it was not found."""
        found = self._tried(grips)
        return None if found is None else found.last

    def note(self, grips: Array, angles: Array, closed: ContactSolution) -> None:
        """Take over an equilibrium that is known already, if the digits have the joint angles (J, 4) of closings (D,).

        Where other digits, which press on nothing, are elsewhere, others start from it.
        """
        apart, mine = np.abs(self.angles(grips) - angles), [joint for one in self.joints for joint in one]
        if closed.converged and apart[mine].max() < SAME_CLOSING:
            self._known.append(_Known(grips.copy(), closed, grips.copy(), same=apart.max() < SAME_CLOSING))

    @property
    def found(self) -> tuple[tuple[Array, ContactInstant], ...]:
        """All equilibria that were found: closings (D,), and the equilibrium there."""
        return tuple((one.grips, one.closed.last) for one in self._known if one.same)

    def spent(self) -> bool:
        """Whether no linear solves are left."""
        return self._budget is not None and self._budget.exhausted

    def _tried(self, grips: Array) -> ContactSolution | None:
        known = (one for one in self._known if one.same and np.abs(one.grips - grips).max() < SAME_CLOSING)
        return next((one.closed for one in known), None)

    def _closed(self, grips: Array) -> ContactSolution | None:
        """Equilibrium at closings, reached from the nearest known one on whose way no digit was bent further by more
        than two load steps.

        Friction remembers its way, and the keys that are found close the digits without opening them again.
        """
        if (same := self._tried(grips)) is not None:
            return same
        if self.spent():
            return None
        begun = [one for one in self._known if self._on_the_way(one, grips)]
        nearest = min(begun, key=lambda one: self._far(one, grips))
        at, before = nearest.grips, nearest.closed
        near = np.maximum(at, np.minimum(grips, self.touch))
        if (near > at + SAME_CLOSING).any():
            found = self._onward(before, at, near, 1)  # nothing touches on the way
            if found.converged:
                at, before = near, found
        found = self._onward(before, at, grips, self._steps(at, grips))
        self.solved += 1
        if not found.converged:
            return None
        self._known.append(_Known(grips.copy(), found, np.maximum(nearest.furthest, grips)))
        return found

    def _on_the_way(self, known: _Known, grips: Array) -> bool:
        """Whether closings are reached from known ones without opening digits by more than two load steps in all."""
        if (known.furthest <= np.maximum(grips, 0.0) + SAME_CLOSING).all():
            return True
        return self._steps(np.maximum(known.furthest, grips), grips) <= _BACK

    def _far(self, known: _Known, grips: Array) -> tuple[int, float]:
        """Load steps from known closings to others, and the sum of the digits' ways [rad]."""
        return self._steps(known.grips, grips), float(np.abs(known.grips - grips).sum())

    def _steps(self, at: Array, grips: Array) -> int:
        """Load steps between closings."""
        return self._hand.bones.steps([(self.angles(end), self._time) for end in (at, grips)], TRAVEL)

    def _onward(self, before: ContactSolution, at: Array, grips: Array, steps: int) -> ContactSolution:
        """Equilibrium at closings (D,) from that at others, in a number of load steps."""

        def moves(share: float) -> Moves:
            return self._hand.bones.moves_of(self.angles(at + share * (grips - at)), self._time)

        budget, closing = self._budget, (self._hand.name, moves)
        most = None if budget is None else max(1, budget.next)
        found = solve_branch(self.model, self._history, before, steps, moves=closing, solves=most, ease=True)
        return found if budget is None else budget.counted(found)

    def _slopes(self, grips: Array, closed: ContactSolution, effort: Effort) -> Array | None:
        """Derivatives of the shares by the closings [1/rad], shape (D, D); None if the equilibrium has none."""
        model, hand, time, angles = self.model, self._hand, self._time, self.angles(grips)
        largest = [int(effort[digit].shares.argmax()) for digit in self.digits]
        out = np.zeros((len(self.digits), len(self.digits)))
        try:
            known = model.prescribed(time, self._history).degrees
            tangent = EquilibriumTangent(model.body, model.pairs, closed, known, steadied=True)
            contact = tangent.contact.sum(axis=0)
            efforts = EffortTangent(model, hand, closed.last, contact, self._posed(angles), self._limits)
            for j, along in enumerate(self._along(grips)):
                change = angles_perturbed(model, hand, angles, time, along)
                response = tangent.response(change)

                def pose(by: float, along: Array = along) -> Poses:
                    return self._posed(angles + by * along)

                found = efforts.slopes(response, change, pose)
                each = [found[effort[digit].digit] for digit in self.digits]
                if self.wanted is not None:
                    out[:, j] = np.array([one.force for one in each]) / self.wanted
                else:
                    out[:, j] = [one.shares[k] for one, k in zip(each, largest, strict=True)]
        except SensitivityError:
            return None
        return out

    def _along(self, grips: Array) -> list[Array]:
        """Derivatives of the angles by each closing, each of shape (J, 4); 0 for joints at their limits."""
        angles, out = self.angles(grips), []
        for joints in self.joints:
            along = np.zeros_like(angles)
            now = angles[joints, FLEXION]
            along[joints, FLEXION] = (now < self._bounds[joints, 1] - SAME_CLOSING) & (
                now > self._bounds[joints, 0] + SAME_CLOSING
            )
            out.append(along)
        return out

    def _posed(self, angles: Array) -> Poses:
        return self._hand.bones.posed(angles, self._time)
