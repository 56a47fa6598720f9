"""Sequential solution of the frames, with a checkpoint after each (R99, R110, R118, R120, R123)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from warpjld.fem import SolveStatus
from warpjld.files.reading import reading
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.frames_run import FramesRun, Progress
from warpjld.simulation.solve.checkpoint import CheckpointFile
from warpjld.simulation.solve.falling import Falls
from warpjld.simulation.solve.solved_frame import SolvedFrame
from warpjld.simulation.solve.untouched import solve_untouched
from warpjld.simulation.solve_result import SolveResult
from warpjld.simulation.specification import ContactSpecification, SolveSpecification

__all__ = ["Progress", "Save", "solve_frames"]

Watch = Callable[[ContactModel, SolvedFrame], str | None]
"""Called with the model and each frame after it is solved; a returned text stops the run (R118)."""

Falling = Callable[[SolveResult], Falls | None]
"""Called before each frame, and where one has no equilibrium; returns the falls of what nothing holds, if any."""

Save = Callable[[CheckpointFile], bool]
"""Saves the frames solved so far; returns False if there is nothing to resume from."""


def solve_frames(
    model: ContactModel,
    frames: Sequence[float],
    contact: ContactSpecification,
    request: SolveSpecification,
    *,
    watch: Watch = lambda model, solved: None,
    falling: Falling = lambda result: None,
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
        falling: Called before each frame, and where one has no equilibrium; what it returns falls, and contact goes on
            with it (R139).
        checkpoint: File of the solved frames; a state left by an earlier run is resumed. Frames after an object is let
            go are not in it.
        saving: Called once before the first frame with a function that saves the frames solved so far, at any time.
        progress: Called with what is being done.

    Raises:
        InputError: The state file belongs to another simulation.
    """
    run = FramesRun(model, contact, request)
    saving(run.save)
    if checkpoint is not None and (found := checkpoint.load(model, frames)) is not None:
        with reading(checkpoint.path, "a state of a contact solve"):
            reasons = run.resume(found, watch)
        if reasons:
            return run.ended(SolveStatus.STOPPED, reasons[0])
    if not model.pairs:
        return _untouched(model, frames, watch, progress)
    try:
        return _solve_on(run, frames, watch, falling, checkpoint, progress)
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
    run: FramesRun,
    frames: Sequence[float],
    watch: Watch,
    falling: Falling,
    checkpoint: CheckpointFile | None,
    progress: Progress,
) -> SolveResult:
    """Solve the remaining frames, and those at which objects that were let go come to rest."""
    contact, ahead = run.contact, list(frames[len(run.done) :])
    while ahead:
        frame = ahead[0]
        progress(f"contact, frame {frame:g}", len(run.done), len(frames))
        falls = falling(run.ended(SolveStatus.CONVERGED, SolveStatus.CONVERGED.value))
        failure = None if falls is not None else run.solve(frame)
        if failure is not None:
            falls = falling(failure)
        if falls is not None and (rests := run.let_go(falls, frames[-1])):
            ahead = sorted({*ahead, *rests})
            continue
        if falls is not None and failure is None:
            failure = run.ended(SolveStatus.UNHELD, f"at frame {frame:g}: nothing holds {falls.listed}")
        if failure is not None:
            return replace(failure, unsolved=falls)
        ahead.pop(0)
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
