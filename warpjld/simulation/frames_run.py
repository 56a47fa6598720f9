"""State of a run over frames: its current model, history and everything found so far."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from warpjld.fem import SolveStatus
from warpjld.fem.contact import ContactSolution
from warpjld.fem.contact.law.contact_state import ContactState, without_bonds
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.correct_frames import correct_frame, uncorrected
from warpjld.simulation.grip.find import find_grip
from warpjld.simulation.grip.found import FoundGrip
from warpjld.simulation.grip.hand_trials import RIDING
from warpjld.simulation.grip.kept import grip_content, restored_grip
from warpjld.simulation.grip.squeeze import TRAVEL
from warpjld.simulation.solve.bone_clearance import TIGHT, BoneClearance, TightBone
from warpjld.simulation.solve.branch import solve_onward
from warpjld.simulation.solve.checkpoint import Checkpoint, CheckpointFile
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
from warpjld.simulation.solve.digit_loads import crushed
from warpjld.simulation.solve.fallen import falling_model, rest_frames
from warpjld.simulation.solve.falling import Falls
from warpjld.simulation.solve.force_limit import BoneInsideError, ForceLimits
from warpjld.simulation.solve.grasp_balance import weight_of
from warpjld.simulation.solve.handed_over import HandedOver
from warpjld.simulation.solve.missed_contacts import MissedContact, missed_contacts
from warpjld.simulation.solve.settle import free_objects, settled
from warpjld.simulation.solve.solved_frame import SolvedFrame, solved_frame
from warpjld.simulation.solve.substeps import Substeps
from warpjld.simulation.solve_result import KnownEquilibrium, SolveResult
from warpjld.simulation.specification import BondStrength, ContactSpecification, GripSpecification, SolveSpecification

__all__ = ["FramesRun", "Progress", "soft_crease"]

_STIFFENS = 3.0
"""Exponent of Fung's law from which flesh is hardly sheared inside out between skin and bone in a crease: a knee of
elements of 20 mm that bends by 110° in 12 steps has equilibria up to 86° with 1, and to the end with 4; with 3 it bends
by 120° in 12 steps, and by 130° in 14."""

_LONGER = 0.25
"""Part of a load step by which those of a frame may be longer than asked for, rather than twice as many."""

_MOMENT = 1e-9
"""Time between two load steps below which they are one [frames]."""

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and how much there is."""


@dataclass(eq=False)
class FramesRun:
    """Mutable state of a run over frames: current model, history and everything found so far."""

    model: ContactModel
    contact: ContactSpecification
    request: SolveSpecification
    history: History = field(default_factory=History)
    last: ContactSolution | None = None
    done: list[SolvedFrame] = field(default_factory=list)
    edited: list[int] = field(default_factory=list)
    resumed: int = 0
    missed: list[MissedContact] = field(default_factory=list)
    edits: list[AngleEdit] = field(default_factory=list)
    grips: list[FoundGrip] = field(default_factory=list)
    corrected: list[CorrectedDigit] = field(default_factory=list)
    uncorrected: list[str] = field(default_factory=list)
    tight: dict[tuple[str, str, str], tuple[float, TightBone]] = field(default_factory=dict)
    equilibria: dict[float, KnownEquilibrium] = field(default_factory=dict)
    settled: tuple[ContactModel, Checkpoint] | None = None
    saved: Checkpoint | None = None
    released: float | None = None
    falls: list[Falls] = field(default_factory=list)
    over: HandedOver | None = None

    def __post_init__(self) -> None:
        self.substeps = Substeps(self.model)
        self.clearance = BoneClearance(self.model)
        # a search for a prescribed force is not limited by what the held objects can oppose
        by_force = any(grip.force is not None for grip in self.contact.grips)
        held = [] if by_force else [name for name in self.model.obstacles if name in self.contact.grasped]
        weights = {name: weight_of(self.model.obstacles[name]) for name in held}
        self.limits = ForceLimits(self.contact.strength, self.request.pressure, weights, self.clearance)

    def resume(self, found: Checkpoint, watch: Callable[[ContactModel, SolvedFrame], str | None]) -> list[str]:
        """Restore a checkpoint, replaying its edits frame by frame; returns the texts that ``watch`` gave."""
        self.last, self.resumed, self.missed = found.solution, len(found.frames), list(found.missed)
        self.corrected, self.uncorrected = list(found.corrected), list(found.uncorrected)
        self.limits.restore(found.limits)
        self.over = found.over
        self.tight = {(one.actor, one.digit, one.object): (frame, one) for frame, one in found.tight}
        grips, reasons = [restored_grip(content, self.contact) for content in found.grips], []
        for solved, count in zip(found.frames, found.edited, strict=True):
            self._edit(found.edits[len(self.edits) : count])
            self._add(solved)
            reasons += [reason] if (reason := watch(self.model, solved)) else []
            for grip in (one for one in grips if one.request.first == solved.frame):
                self.grips.append(grip)
                self._edit(found.edits[len(self.edits) : len(self.edits) + len(grip.edits)])
                self._release(grip)
        self._settle()
        return reasons

    def _add(self, solved: SolvedFrame) -> None:
        """Append a solved frame, with the number of edits made up to it."""
        self.done.append(solved)
        self.edited.append(len(self.edits))
        self._note(solved)

    def solve(self, frame: float) -> SolveResult | None:
        """Solve and append a frame; returns the final result if the frame cannot be solved."""
        model, time, before = self.model, frame - self.model.start, self._settled_objects(frame - self.model.start)
        now = np.zeros_like(model.body.mesh.nodes) if before is None else before.last.displacement
        since = 0.0 if before is None else before.last.time
        steps = self._as_searched(model, since, self.substeps.times(model, since, time, now))
        if self.request.limited:
            try:
                solution = self._handed_over(since, steps) or self.limits.solve(model, self.history, before, steps)
            except BoneInsideError as error:
                return self.ended(SolveStatus.BLOCKED, str(error))
            driven = self.limits.driven(model)
        else:
            driven = model
            if (inside := self._bone_inside(model, steps)) is not None:
                return self.ended(SolveStatus.BLOCKED, inside)
            eases = self.request.method != "paper"
            solution = self._handed_over(since, steps) or solve_onward(
                model, self.history, before, steps, method=self.request.method, aitken=self.request.aitken, ease=eases
            )
        if not solution.converged:
            ahead = [self._bone_inside(driven, [step]) for step in steps if step > solution.last.time]
            parts = solution.message, self.clearance.crushing(driven, steps[-1]), crushed(solution.pressed)
            why = "; ".join(filter(None, parts)) + soft_crease(self.contact)
            reason = next(filter(None, ahead), f"at frame {frame:g}: {why}")
            return self.ended(solution.status, reason)
        self._note_bones(driven, frame)
        self._edit(self.limits.edits(model, since, time))
        if self.request.correct:
            strength = self.contact.strength
            corrected = (
                uncorrected(model, solution, strength, frame)
                if before is None
                else correct_frame(model, self.history, before, solution, strength)
            )
            self.corrected += corrected.digits
            self.uncorrected += corrected.failed
            solution = corrected.solution
            self._edit(corrected.edits)
        bare = replace(solution, instants=(replace(solution.last, touches=()),))
        self.equilibria[float(frame)] = KnownEquilibrium(self.model, self.history, bare)
        self.missed += missed_contacts(model, self.done[-1] if self.done else None, solution.instants)
        self.last = solution
        self.over = self.over if self.over is not None and self.over.free > time else None
        self._add(solved_frame(float(frame), solution.instants, solution.states))
        if all(grip.first != frame for grip in self.contact.grips):  # otherwise after the grip search
            self._settle()
        return None

    def _settled_objects(self, time: float) -> ContactSolution | None:
        """The last solution; where free objects came to rest as rigid bodies, with them at rest as deformable ones."""
        model, last = self.limits.driven(self.model), self.last
        names = free_objects(model, self.contact.bonds, None if last is None else last.last.time, time)
        if not names or self.request.method == "paper":
            return last
        return settled(model, self.history, last, names)

    def _handed_over(self, since: float, steps: Sequence[float]) -> ContactSolution | None:
        """Solve the frame from which on a hand alone holds an object, from the equilibrium its search found; None in
        other frames, or if the hand is elsewhere by then."""
        over, model = self.over, self.model
        start = None if over is None else over.start(self.limits.driven(model), self.history, since, steps[-1])
        if over is None or start is None:
            return None
        ahead = [over.free, *(step for step in steps if step > over.free + _MOMENT)]
        if self.request.limited:
            found = self.limits.solve(model, self.history, start, ahead)
        else:
            found = solve_onward(model, self.history, start, ahead, method=self.request.method)
        return found if found.converged else None

    def _as_searched(self, model: ContactModel, since: float, steps: list[float]) -> list[float]:
        """Load steps of a frame in which a grip closes, refined to be no longer than those of the grip search.

        Friction forces depend on the step length, and the grip was chosen with short steps.
        """
        closing = [one.request for one in self.grips if one.edits]
        if all(one.last <= model.start + since or one.first > model.start + since for one in closing):
            return steps
        ends, count = (since, steps[-1]), len(steps)
        travel = RIDING if any(one.release is not None for one in self.grips) else TRAVEL
        for hand in (one for one in model.hands if any(one.name == grip.actor for grip in closing)):
            count = max(count, hand.bones.steps([(hand.bones.angles(at), at) for at in ends], travel))
        for release in (one.release for one in self.grips if one.release is not None):
            if release.over < steps[-1] and since < release.free:
                count = max(count, math.ceil((steps[-1] - since) / release.step - _LONGER))
        return [since + (steps[-1] - since) * (k + 1) / count for k in range(count - 1)] + [steps[-1]]

    def save(self, checkpoint: CheckpointFile) -> bool:
        """Save the solved frames; returns False if there are none."""
        if self.saved is None:
            return False
        checkpoint.save(self.saved)
        return True

    def interrupted(self) -> SolveResult:
        """Result as of the last completely solved frame."""
        if self.settled is not None:
            self.model, known = self.settled
            self.done, self.edits, self.missed = list(known.frames), list(known.edits), list(known.missed)
            self.grips, self.edited = self.grips[: len(known.grips)], list(known.edited)
            self.corrected, self.uncorrected = list(known.corrected), list(known.uncorrected)
        after = self.done[-1].frame
        return replace(self.ended(SolveStatus.STOPPED, f"interrupted after frame {after:g}"), interrupted=True)

    def _settle(self) -> None:
        """Take a consistent snapshot between two frames, since an interrupt may come at any time within one."""
        assert self.last is not None
        tight, limits = tuple(self.tight.values()), self.limits.content()
        parts = (tuple(self.edits), limits, tuple(self.missed), tight, tuple(map(grip_content, self.grips)))
        corrections = tuple(self.corrected), tuple(self.uncorrected)
        known = Checkpoint(tuple(self.done), self.last, *parts, tuple(self.edited), *corrections, over=self.over)
        self.settled = self.model, known
        if self.released is None:
            self.saved = known

    def _bone_inside(self, model: ContactModel, times: Sequence[float]) -> str | None:
        """Message about a bone inside an object at one of the times; None if there is none."""
        found = (self.clearance.inside(model, time) for time in times)
        return next(filter(None, found), None)

    def _note_bones(self, model: ContactModel, frame: float) -> None:
        """Record the smallest clearance of bones from objects and from one another."""
        time = frame - model.start
        for one in (*self.clearance.nearest(model, time), *self.clearance.between_digits(model, time)):
            place = (one.actor, one.digit, one.object)
            if one.left < TIGHT and (place not in self.tight or one.left < self.tight[place][1].left):
                self.tight[place] = (frame, one)

    def find(self, grip: GripSpecification, progress: Progress, total: int) -> FoundGrip:
        """Search for a grip and apply its edits; ``progress`` is called for every trial grip."""
        what = f"looking for a grip, frame {grip.first:g}"
        progress(what, len(self.done), total)
        assert self.last is not None
        limits = self.contact.strength.get(grip.actor, {})

        def report(line: str) -> None:
            progress(f"{what}: {line}", len(self.done), total)

        found = find_grip(self.model, self.history, grip, self.last, limits, report)
        apart = all(one.release is None or grip.first - self.model.start >= one.release.free for one in self.grips)
        self.over = found.over if apart else None  # it knows nothing of what another hand lifts meanwhile
        self.grips.append(found)
        self._edit(found.edits)
        self._release(found)
        if not found.interrupted:
            self._settle()
        return found

    def _release(self, found: FoundGrip) -> None:
        """Release the objects' supports as the grip prescribes."""
        if found.release is not None:
            objects = [found.release.applied(one) for one in self.model.objects]
            self.model = replace(self.model, objects=tuple(objects))

    def let_go(self, found: Falls, last: float) -> list[float]:
        """Let objects fall along their paths; returns the frames at which they rest, empty if contact cannot go on."""
        rests = [] if found.interrupted is not None else rest_frames(self.model, found.paths, last)
        if rests and self.last is not None:
            self.released = self.done[-1].frame if self.released is None else self.released
            self.model = falling_model(self.model, found.paths)
            self.last = replace(self.last, states=_opened(self.model, self.last.states, found.bonds))
            self.falls.append(found)
        return rests if self.last is not None else []

    def ended(self, status: SolveStatus, message: str) -> SolveResult:
        """Final result of the run with a status."""
        return SolveResult(
            status,
            message,
            self.model,
            tuple(self.done),
            self.resumed,
            tuple(self.missed),
            tuple(self.edits),
            tuple(self.grips),
            tuple(self.corrected),
            tuple(self.uncorrected),
            tuple(self.limits.stops),
            tuple(self.tight.values()),
            self.equilibria,
            self.released,
            tuple(self.falls),
        )

    def _edit(self, edits: Sequence[AngleEdit]) -> None:
        self.edits += edits
        self.model = self.model.edited(edits)

    def _note(self, solved: SolvedFrame) -> None:
        self.history = self.model.after(solved.nodal)


def soft_crease(contact: ContactSpecification) -> str:
    """What to try where flesh bends by its bones and hardly stiffens; empty if none does."""
    for name, flesh in contact.flesh.items():
        if flesh.flexion and flesh.stiffening < _STIFFENS:
            return (
                f"; flesh of {name} has STIFFENING {flesh.stiffening:g}: in creases it shears inside out more easily "
                f"where it is thin over a bone than with {_STIFFENS:g} or more"
            )
    return ""


def _opened(
    model: ContactModel, states: Sequence[ContactState], bonds: Sequence[BondStrength]
) -> tuple[ContactState, ...]:
    """Contact states of the model's pairs in which only the given bonds hold, where they have not parted."""
    held = {frozenset((bond.one, bond.other)): bond.parted for bond in bonds}
    out = []
    for pair, owner, state in zip(model.pairs, model.owners, states, strict=True):
        parted = held.get(frozenset((owner.slave, owner.master)))
        if pair.bond is not None and parted != ():
            count = len(state.bonded)
            state = without_bonds(state, np.ones(count, dtype=bool) if parted is None else np.array(parted))
        out.append(state)
    return tuple(out)
