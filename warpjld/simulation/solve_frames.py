"""Frames solved one after another, each kept as soon as it is done (R99, R110, R118, R120, R123)."""

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
from warpjld.simulation.grip.find import FoundGrip, find_grip
from warpjld.simulation.grip.kept import grip_content, restored_grip
from warpjld.simulation.solve.bone_clearance import TIGHT, BoneClearance, TightBone
from warpjld.simulation.solve.branch import solve_onward
from warpjld.simulation.solve.checkpoint import Checkpoint, CheckpointFile
from warpjld.simulation.solve.corrected_digit import CorrectedDigit
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
"""Told what is being done, how much of it is done, and how much there is."""


Watch = Callable[[ContactModel, SolvedFrame], str | None]

Save = Callable[[CheckpointFile], bool]
"""Saves what is solved so far; False where there is nothing to go on from."""


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
    """Solve contact at frames; Ctrl-C ends it with those that were solved, if any were.

    Args:
        model: What may touch, at rest at its start: before anything touches, or where overlaps begin to part (R112).
        frames: Rising, after that start.
        contact: What is asked of contact: grips to find, and how strong muscles are.
        request: How to solve.
        watch: Told the model and each frame as it is solved; a text stops the run there (R118).
        checkpoint: Holds what was solved so far; an earlier run's is gone on from.
        saving: Told before the first frame what saves, at any time, the frames that are solved by then.
        progress: Told about the work.

    Raises:
        InputError: A state that belongs to something else.
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
    """Frames of bodies with nothing to touch."""
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
    """Solve the frames that are not done yet."""
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
    """What is known so far of frames that are being solved."""

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
        asked = any(grip.force is not None for grip in self.contact.grips)  # for a force, whatever opposes it
        held = [] if asked else [name for name in self.model.obstacles if name in self.contact.grasped]
        weights = {name: weight_of(self.model.obstacles[name]) for name in held}
        self.limits = ForceLimits(self.contact.strength, self.request.pressure, weights, self.clearance)

    def resume(self, found: Checkpoint, watch: Watch) -> list[str]:
        """Go on from what another run left, with the model of each frame as it was then; what ``watch`` says."""
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
        """Note a frame that is solved, and how many edits there were by then."""
        self.done.append(solved)
        self.edited.append(len(self.edits))
        self._note(solved)

    def solve(self, frame: float) -> SolveResult | None:
        """Add a frame; what ended all where it cannot be solved."""
        model, time, before = self.model, frame - self.model.start, self.last
        now = np.zeros_like(model.body.mesh.nodes) if before is None else before.last.displacement
        steps = self.substeps.times(model, 0.0 if before is None else before.last.time, time, now)
        since = 0.0 if before is None else before.last.time
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
            reason = next(filter(None, ahead), f"at frame {frame:g}: {solution.message}")
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
        self._add(solved_frame(float(frame), solution.instants))
        if all(grip.first != frame for grip in self.contact.grips):  # else when the grip is found
            self._settle()
        return None

    def save(self, checkpoint: CheckpointFile) -> bool:
        """Save all frames that are solved; False where none is."""
        if self.settled is None:
            return False
        checkpoint.save(self.settled[1])
        return True

    def interrupted(self) -> SolveResult:
        """All of it as it was after the last frame that was solved."""
        if self.settled is not None:
            self.model, known = self.settled
            self.done, self.edits, self.missed = list(known.frames), list(known.edits), list(known.missed)
            self.grips, self.edited = self.grips[: len(known.grips)], list(known.edited)
            self.corrected, self.uncorrected = list(known.corrected), list(known.uncorrected)
        after = self.done[-1].frame
        return replace(self.ended(SolveStatus.STOPPED, f"interrupted after frame {after:g}"), interrupted=True)

    def _settle(self) -> None:
        """Remember how things are between two frames: an interrupt falls anywhere within one."""
        assert self.last is not None
        tight, limits = tuple(self.tight.values()), self.limits.content()
        parts = (tuple(self.edits), limits, tuple(self.missed), tight, tuple(map(grip_content, self.grips)))
        corrections = tuple(self.corrected), tuple(self.uncorrected)
        known = Checkpoint(tuple(self.done), self.last, *parts, tuple(self.edited), *corrections)
        self.settled = self.model, known

    def _bone_inside(self, model: ContactModel, times: Sequence[float]) -> str | None:
        """A bone that lies in an object at one of some times, in words: no force can part them."""
        found = (self.clearance.inside(model, time) for time in times)
        return next(filter(None, found), None)

    def _note_bones(self, model: ContactModel, frame: float) -> None:
        """Remember what bones are near to objects."""
        for one in self.clearance.nearest(model, frame - model.start):
            place = (one.actor, one.digit, one.object)
            if one.left < TIGHT and (place not in self.tight or one.left < self.tight[place][1].left):
                self.tight[place] = (frame, one)

    def find(self, grip: GripSpecification, progress: Progress, total: int) -> FoundGrip:
        """Look for a grip, and go on with it; ``progress`` hears of every grip that is tried."""
        what = f"looking for a grip, frame {grip.first:g}"
        progress(what, len(self.done), total)
        assert self.last is not None
        limits = self.contact.strength.get(grip.actor, {})

        def tell(line: str) -> None:
            progress(f"{what}: {line}", len(self.done), total)

        found = find_grip(self.model, self.history, grip, self.last, limits, tell)
        self.grips.append(found)
        self._edit(found.edits)
        self._release(found)
        if not found.interrupted:
            self._settle()
        return found

    def _release(self, found: FoundGrip) -> None:
        """Let the support go as a grip has it."""
        if found.release is not None:
            objects = [found.release.applied(one) for one in self.model.objects]
            self.model = replace(self.model, objects=tuple(objects))

    def ended(self, status: SolveStatus, message: str) -> SolveResult:
        """All of it."""
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
