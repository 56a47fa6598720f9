"""Digits opened at frames where they bear more than their muscles can (R120)."""

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
"""Share of their limits that digits may reach."""
_STILL = 1e-3
"""Flexion that is none [rad]."""


@dataclass(frozen=True, eq=False)
class CorrectedFrame:
    """A frame after all hands that bore too much were corrected.

    Attributes:
        solution: The equilibrium at the corrected angles, or the one found where nothing had to be.
        edits: The corrected angles.
        digits: What was opened.
        failed: What could not be, in words.
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
    """Open the digits that bear too much at a frame.

    Args:
        model: Everything.
        history: What is known at the frame before.
        before: Equilibrium there.
        found: Equilibrium at the frame, at the angles of the animation.
        limits: Largest forces of digits [N], by actor and digit, where they are not the default.
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
    """Of every digit the frame at which it bore most before it was corrected."""
    out: dict[tuple[str, str], CorrectedDigit] = {}
    for one in digits:
        place = (one.actor, one.digit)
        if place not in out or one.before > out[place].before:
            out[place] = one
    return list(out.values())


@dataclass(frozen=True, eq=False)
class _Hand:
    """One hand on its way from a frame to the next."""

    model: ContactModel
    history: History
    hand: FleshBody
    before: ContactSolution
    limits: Mapping[str, float] | None

    def corrected(self, found: ContactSolution) -> CorrectedFrame:
        """The equilibrium at the corrected angles, or the one found where nothing has to be."""
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
        edits, digits = self._edits(corrected, since, time), self._digits(corrected, first, frame)
        return CorrectedFrame(chosen[-1], edits, digits)

    def _edits(self, corrected: CorrectedPose, since: float, time: float) -> tuple[AngleEdit, ...]:
        names = [f"{digit}.{knuckle}" for digit in corrected.opened for knuckle in KNUCKLES]
        start, joints = self.model.start, [self.hand.bones.skeleton.index(name) for name in names]
        return tuple(
            AngleEdit(self.hand.name, joint, start + since, start + time, float(corrected.angles[joint, FLEXION]))
            for joint in joints
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
        """Equilibrium at other angles than the animation's, reached from the frame before."""
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
        """How each digit's share follows its own way; None where that is not known."""
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
    """The first frame that is solved: what bears too much there is named, since nothing came before to open from."""
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
    """What bears too much, and why opening does not help, of joints (J,) that have closed by so much [rad]."""
    names = [one.digit for one in effort.digits if one.share > _AIM]
    joints = [hand.bones.skeleton.index(f"{name}.{knuckle}") for name in names for knuckle in KNUCKLES]
    why = status.value
    if status is not Correction.NO_SOLUTION and (closed[joints] < _STILL).all():
        why = "its joints have not closed, and have no way back: MOVE, TURN or the object presses it; move that away"
    return f"{_too_much(hand, frame, effort)}: {why}"


def _posed_along(
    hand: FleshBody, angles: NDArray[np.float64], way: NDArray[np.float64], time: float, by: float
) -> Poses:
    """The pose so far along a way."""
    return hand.bones.posed(angles + by * way, time)
