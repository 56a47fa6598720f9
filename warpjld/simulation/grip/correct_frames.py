"""Correction of solved frames: digits are opened where they exceed the limits of their muscles (R120)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import ContactSolution
from warpjld.fem.contact.sensitivity.equilibrium_tangent import EquilibriumTangent, SensitivityError
from warpjld.fem.hand.muscles import KNUCKLES, Effort
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.flesh_body import FleshBody
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.correct import CorrectedPose, Correction, correct_angles
from warpjld.simulation.grip.squeeze import TRAVEL
from warpjld.simulation.report.efforts import effort_at
from warpjld.simulation.sensitivity.effort_slope import EffortTangent
from warpjld.simulation.sensitivity.parameters import angles_perturbed
from warpjld.simulation.solve.branch import solve_branch
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
from warpjld.skeleton import Poses
from warpjld.skeleton.channels import FLEXION

__all__ = ["CorrectedFrame", "correct_frame", "uncorrected", "worst_digits"]

_AIM = 1.0
"""Load share (load over limit) that digits may reach."""
_STILL = 1e-3
"""Change of flexion below which a joint counts as not having closed [rad]."""


@dataclass(frozen=True, eq=False)
class CorrectedFrame:
    """A frame after the correction of all hands above their limits.

    Attributes:
        solution: Equilibrium at the corrected angles; the original one if no correction was needed or possible.
        edits: Corrected angles as edits of the animation.
        digits: Corrected digits.
        failed: Messages about hands that could not be corrected.
    """

    solution: ContactSolution
    edits: tuple[AngleEdit, ...] = ()
    digits: tuple[CorrectedDigit, ...] = ()
    failed: tuple[str, ...] = ()


def correct_frame(
    model: ContactModel,
    history: History,
    before: ContactSolution,
    found: ContactSolution,
    limits: Mapping[str, Mapping[str, float]],
) -> CorrectedFrame:
    """Open the digits that exceed their limits at a frame.

    Args:
        model: The contact model.
        history: History at the previous frame.
        before: Equilibrium at the previous frame.
        found: Equilibrium at the frame, at the angles of the animation.
        limits: Force limits of digits that differ from the default [N], by actor and digit.
    """
    out = CorrectedFrame(found)
    for hand in model.hands:
        if hand.bones.bendable:
            one = _Hand(model, history, hand, before, limits.get(hand.name)).corrected(out.solution)
            model = model.edited(one.edits)
            edits, digits, failed = out.edits + one.edits, out.digits + one.digits, out.failed + one.failed
            out = CorrectedFrame(one.solution, edits, digits, failed)
    return out


def worst_digits(digits: Sequence[CorrectedDigit]) -> list[CorrectedDigit]:
    """For every corrected digit, the frame at which its force before correction was largest."""
    out: dict[tuple[str, str], CorrectedDigit] = {}
    for one in digits:
        place = (one.actor, one.digit)
        if place not in out or one.before > out[place].before:
            out[place] = one
    return list(out.values())


@dataclass(frozen=True, eq=False)
class _Hand:
    """Correction of one hand between two frames."""

    model: ContactModel
    history: History
    hand: FleshBody
    before: ContactSolution
    limits: Mapping[str, float] | None

    def corrected(self, found: ContactSolution) -> CorrectedFrame:
        """Corrected frame; with ``found`` unchanged if no correction is needed or possible."""
        bones, time, since = self.hand.bones, found.last.time, self.before.last.time
        wanted, then, opened = bones.angles(time), bones.angles(since), bones.angles(0.0)
        first = self._effort(wanted, found)
        if first.share <= _AIM:
            return CorrectedFrame(found)
        tried: list[tuple[NDArray[np.float64], ContactSolution]] = [(wanted, found)]

        def solve(angles: NDArray[np.float64]) -> Effort | None:
            if np.array_equal(angles, wanted):
                return first
            solution = self._at(then, angles, time - since)
            if not solution.converged:
                return None
            tried.append((angles.copy(), solution))
            return self._effort(angles, solution)

        def slopes(angles: NDArray[np.float64], ways: Mapping[str, NDArray[np.float64]]) -> dict[str, float] | None:
            solution = next(found for known, found in reversed(tried) if np.array_equal(known, angles))
            return self._slopes(angles, solution, ways)

        corrected = correct_angles(solve, bones.skeleton, wanted, opened, aim=_AIM, slopes=slopes)
        chosen = [solution for angles, solution in tried if np.array_equal(angles, corrected.angles)]
        frame = self.model.start + time
        if corrected.status is not Correction.CORRECTED or not chosen:
            closed = np.abs(wanted - opened)[:, FLEXION]
            return CorrectedFrame(found, failed=(_not_corrected(self.hand, frame, first, corrected.status, closed),))
        edits, digits = self._edits(corrected, wanted, since, time), self._digits(corrected, first, frame)
        return CorrectedFrame(chosen[-1], edits, digits)

    def _edits(
        self, corrected: CorrectedPose, wanted: NDArray[np.float64], since: float, time: float
    ) -> tuple[AngleEdit, ...]:
        """Edits of the joints that were opened; others of the same digits may have no keys."""
        names = [f"{digit}.{knuckle}" for digit in corrected.opened for knuckle in KNUCKLES]
        start, joints = self.model.start, [self.hand.bones.skeleton.index(name) for name in names]
        return tuple(
            AngleEdit(self.hand.name, joint, start + since, start + time, float(corrected.angles[joint, FLEXION]))
            for joint in joints
            if corrected.angles[joint, FLEXION] != wanted[joint, FLEXION]
        )

    def _digits(self, corrected: CorrectedPose, first: Effort, frame: float) -> tuple[CorrectedDigit, ...]:
        assert corrected.effort is not None
        out = []
        for name, by in corrected.opened.items():
            was, now = first[name], corrected.effort[name]
            opened = (float(by[0]), float(by[1]), float(by[2]))
            status = corrected.status.name
            out.append(CorrectedDigit(self.hand.name, frame, name, was.force, now.force, was.limit, opened, status))
        return tuple(out)

    def _at(self, then: NDArray[np.float64], angles: NDArray[np.float64], duration: float) -> ContactSolution:
        """Equilibrium at given angles, reached from the previous frame."""
        bones, since = self.hand.bones, self.before.last.time
        steps = bones.steps([(then, since), (angles, since + duration)], TRAVEL)
        moves = (
            self.hand.name,
            lambda share: bones.moves_of(then + share * (angles - then), since + share * duration),
        )
        return solve_branch(self.model, self.history, self.before, steps, moves=moves, duration=duration)

    def _slopes(
        self, angles: NDArray[np.float64], solution: ContactSolution, ways: Mapping[str, NDArray[np.float64]]
    ) -> dict[str, float] | None:
        """Derivative of each digit's load share along its direction of closing; None if not known."""
        model, hand, time = self.model, self.hand, solution.last.time
        if solution.last_step is None:
            return None
        try:
            known = model.prescribed(time, self.history).degrees
            tangent = EquilibriumTangent(model.body, model.pairs, solution, known, steadied=True)
            contact, poses = tangent.contact.sum(axis=0), hand.bones.posed(angles, time)
            efforts = EffortTangent(model, hand, solution.last, contact, poses, self.limits)
            now, out = self._effort(angles, solution), {}
            for digit, way in ways.items():
                change = angles_perturbed(model, hand, angles, time, way)
                ahead = partial(_posed_along, hand, angles, way, time)
                found = efforts.slopes(tangent.response(change), change, ahead)
                out[digit] = float(found[digit].shares[int(now[digit].shares.argmax())])
            return out
        except SensitivityError:
            return None

    def _effort(self, angles: NDArray[np.float64], solution: ContactSolution) -> Effort:
        poses = self.hand.bones.posed(angles, solution.last.time)
        return effort_at(self.model, self.hand, poses, solution.last, self.limits)


def uncorrected(
    model: ContactModel, found: ContactSolution, limits: Mapping[str, Mapping[str, float]], frame: float
) -> CorrectedFrame:
    """The first solved frame, which has none before it to correct from: names the digits above their limits."""
    failed = []
    for hand in model.hands:
        if hand.bones.bendable:
            poses = hand.bones.posed(hand.bones.angles(found.last.time), found.last.time)
            effort = effort_at(model, hand, poses, found.last, limits.get(hand.name))
            if effort.share > _AIM:
                why = "it is the first frame solved, and there is none to open from: begin PRESS earlier"
                failed.append(f"{_too_much(hand, frame, effort)}: {why}")
    return CorrectedFrame(found, failed=tuple(failed))


def _too_much(hand: FleshBody, frame: float, effort: Effort) -> str:
    """``LEFT at frame 8: index 61 N of 59 N (104 %) was not corrected``."""
    over = "; ".join(f"{one.text} ({100.0 * one.share:.0f} %)" for one in effort.digits if one.share > _AIM)
    return f"{hand.name} at frame {frame:g}: {over} was not corrected"


def _not_corrected(
    hand: FleshBody, frame: float, effort: Effort, status: Correction, closed: NDArray[np.float64]
) -> str:
    """Message about digits above their limits and why opening failed; ``closed``: change of flexion by joint [rad],
    shape (J,)."""
    names = [one.digit for one in effort.digits if one.share > _AIM]
    joints = [hand.bones.skeleton.index(f"{name}.{knuckle}") for name in names for knuckle in KNUCKLES]
    why = status.value
    if status is not Correction.NO_SOLUTION and (closed[joints] < _STILL).all():
        why = "its joints have not closed, and have no way back: MOVE, TURN or the object presses it; move that away"
    return f"{_too_much(hand, frame, effort)}: {why}"


def _posed_along(
    hand: FleshBody, angles: NDArray[np.float64], way: NDArray[np.float64], time: float, by: float
) -> Poses:
    """Pose at the angles moved by ``by`` along a direction (J, 4)."""
    return hand.bones.posed(angles + by * way, time)
