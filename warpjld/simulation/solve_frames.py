"""Sequential solution of the frames, with a checkpoint after each (R99, R110, R118, R120, R123)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from warpjld.fem import SolveStatus
from warpjld.fem.contact import ContactSolution
from warpjld.files.reading import reading
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.grip.correct_frames import correct_frame, uncorrected
from warpjld.simulation.grip.find import find_grip
from warpjld.simulation.grip.found import FoundGrip
from warpjld.simulation.grip.kept import grip_content, restored_grip
from warpjld.simulation.grip.squeeze import TRAVEL
from warpjld.simulation.solve.bone_clearance import TIGHT, BoneClearance, TightBone
from warpjld.simulation.solve.branch import solve_onward
from warpjld.simulation.solve.checkpoint import Checkpoint, CheckpointFile
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
from warpjld.simulation.solve.digit_loads import crushed
from warpjld.simulation.solve.force_limit import BoneInsideError, ForceLimits
from warpjld.simulation.solve.grasp_balance import weight_of
from warpjld.simulation.solve.missed_contacts import MissedContact, missed_contacts
from warpjld.simulation.solve.solved_frame import SolvedFrame, solved_frame
from warpjld.simulation.solve.substeps import Substeps
from warpjld.simulation.solve.untouched import solve_untouched
from warpjld.simulation.solve_result import KnownEquilibrium, SolveResult
from warpjld.simulation.specification import ContactSpecification, GripSpecification, SolveSpecification

__all__ = ["Progress", "Save", "solve_frames"]

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and how much there is."""

Watch = Callable[[ContactModel, SolvedFrame], str | None]
"""Called with the model and each frame after it is solved; a returned text stops the run (R118)."""

Save = Callable[[CheckpointFile], bool]
"""Saves the frames solved so far; returns False if there is nothing to resume from."""


def solve_frames(
    model: ContactModel,
    frames: Sequence[float],
    contact: ContactSpecification,
    request: SolveSpecification,
    *,
    watch: Watch = lambda model, solved: None,
    checkpoint: CheckpointFile | None = None,
    saving: Callable[[Save], None] = lambda save: None,
    progress: Progress = lambda what, done, total: None,
) -> SolveResult:
    """Solve contact at the given frames; Ctrl-C ends the run with the frames solved so far, if there are any.

    Args:
        model: Bodies and contact pairs, at rest at the model's start: before any contact, or with initial overlaps that
            are removed gradually (R112).
        frames: Frame numbers after that start, ascending.
        contact: Grips to find and strength of the muscles.
        request: Solution method and options.
        watch: Called after each solved frame; a returned text stops the run (R118).
        checkpoint: File of the solved frames; a state left by an earlier run is resumed.
        saving: Called once before the first frame with a function that saves the frames solved so far, at any time.
        progress: Called with what is being done.

    Raises:
        InputError: The state file belongs to another simulation.
    """
    run = _Run(model, contact, request)
    saving(run.save)
    if checkpoint is not None and (found := checkpoint.load(model, frames)) is not None:
        with reading(checkpoint.path, "a state of a contact solve"):
            reasons = run.resume(found, watch)
        if reasons:
            return run.ended(SolveStatus.STOPPED, reasons[0])
    if not model.pairs:
        return _untouched(model, frames, watch, progress)
    try:
        return _solve_on(run, frames, watch, checkpoint, progress)
    except KeyboardInterrupt:
        if not run.done:
            raise
        return run.interrupted()


def _untouched(model: ContactModel, frames: Sequence[float], watch: Watch, progress: Progress) -> SolveResult:
    """Solve the frames of bodies without any contact pair."""
    done: list[SolvedFrame] = []
    try:
        status, message = solve_untouched(model, frames, done, watch, progress)
    except KeyboardInterrupt:
        if not done:
            raise
        message = f"interrupted after frame {done[-1].frame:g}"
        return SolveResult(SolveStatus.STOPPED, message, model, tuple(done), interrupted=True)
    return SolveResult(status, message, model, tuple(done))


def _solve_on(
    run: _Run, frames: Sequence[float], watch: Watch, checkpoint: CheckpointFile | None, progress: Progress
) -> SolveResult:
    """Solve the remaining frames."""
    contact = run.contact
    for frame in frames[len(run.done) :]:
        progress(f"contact, frame {frame:g}", len(run.done), len(frames))
        failure = run.solve(frame)
        if failure is not None:
            return failure
        grip = next((one for one in contact.grips if one.first == frame), None)
        if checkpoint is not None and grip is None:
            run.save(checkpoint)
        if reason := watch(run.model, run.done[-1]):
            return run.ended(SolveStatus.STOPPED, reason)
        if grip is not None:
            searched = run.find(grip, progress, len(frames))
            if searched.interrupted:
                return replace(run.ended(SolveStatus.STOPPED, f"at frame {frame:g}: {searched.text}"), interrupted=True)
            if checkpoint is not None:
                run.save(checkpoint)
    return run.ended(SolveStatus.CONVERGED, SolveStatus.CONVERGED.value)


@dataclass(eq=False)
class _Run:
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

    def __post_init__(self) -> None:
        self.substeps = Substeps(self.model)
        self.clearance = BoneClearance(self.model)
        # a search for a prescribed force is not limited by what the held objects can oppose
        by_force = any(grip.force is not None for grip in self.contact.grips)
        held = [] if by_force else [name for name in self.model.obstacles if name in self.contact.grasped]
        weights = {name: weight_of(self.model.obstacles[name]) for name in held}
        self.limits = ForceLimits(self.contact.strength, self.request.pressure, weights, self.clearance)

    def resume(self, found: Checkpoint, watch: Watch) -> list[str]:
        """Restore a checkpoint, replaying its edits frame by frame; returns the texts that ``watch`` gave."""
        self.last, self.resumed, self.missed = found.solution, len(found.frames), list(found.missed)
        self.corrected, self.uncorrected = list(found.corrected), list(found.uncorrected)
        self.limits.restore(found.limits)
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
        model, time, before = self.model, frame - self.model.start, self.last
        now = np.zeros_like(model.body.mesh.nodes) if before is None else before.last.displacement
        since = 0.0 if before is None else before.last.time
        steps = self._as_searched(model, since, self.substeps.times(model, since, time, now))
        if self.request.limited:
            try:
                solution = self.limits.solve(model, self.history, before, steps)
            except BoneInsideError as error:
                return self.ended(SolveStatus.BLOCKED, str(error))
            driven = self.limits.driven(model)
        else:
            driven = model
            if (inside := self._bone_inside(model, steps)) is not None:
                return self.ended(SolveStatus.BLOCKED, inside)
            solution = solve_onward(
                model, self.history, before, steps, method=self.request.method, aitken=self.request.aitken
            )
        if not solution.converged:
            ahead = [self._bone_inside(driven, [step]) for step in steps if step > solution.last.time]
            parts = solution.message, self.clearance.crushing(driven, steps[-1]), crushed(solution.pressed)
            why = "; ".join(filter(None, parts))
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
        self._add(solved_frame(float(frame), solution.instants, solution.states))
        if all(grip.first != frame for grip in self.contact.grips):  # otherwise after the grip search
            self._settle()
        return None

    def _as_searched(self, model: ContactModel, since: float, steps: list[float]) -> list[float]:
        """Load steps of a frame in which a grip closes, refined to be no longer than those of the grip search.

        Friction forces depend on the step length, and the grip was chosen with short steps.
        """
        closing = [one.request for one in self.grips if one.edits]
        if all(one.last <= model.start + since or one.first > model.start + since for one in closing):
            return steps
        ends, count = (since, steps[-1]), len(steps)
        for hand in (one for one in model.hands if any(one.name == grip.actor for grip in closing)):
            count = max(count, hand.bones.steps([(hand.bones.angles(at), at) for at in ends], TRAVEL))
        return [since + (steps[-1] - since) * (k + 1) / count for k in range(count - 1)] + [steps[-1]]

    def save(self, checkpoint: CheckpointFile) -> bool:
        """Save the solved frames; returns False if there are none."""
        if self.settled is None:
            return False
        checkpoint.save(self.settled[1])
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
        known = Checkpoint(tuple(self.done), self.last, *parts, tuple(self.edited), *corrections)
        self.settled = self.model, known

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
        )

    def _edit(self, edits: Sequence[AngleEdit]) -> None:
        self.edits += edits
        self.model = self.model.edited(edits)

    def _note(self, solved: SolvedFrame) -> None:
        time = solved.frame - self.model.start
        self.history = self.model.after(self.history, time, solved.displacement, solved.reactions, solved.nodal)
