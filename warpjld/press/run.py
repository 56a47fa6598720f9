"""Frames solved one after another, each kept as soon as it is done (R99, R110, R118)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from warpjld.errors import InputError
from warpjld.fem import Status
from warpjld.fem.contact import ContactSolution, press
from warpjld.press.bodies import Bodies
from warpjld.press.checks import why_not
from warpjld.press.frames import SolvedFrame, solved_frame
from warpjld.press.state import State, load_state, save_state

__all__ = ["Solved", "solve_frames"]

_TOLERANCE = 1e-4
"""Residual over the forces that balance: what a film and a table of newtons need."""


@dataclass(frozen=True, eq=False)
class Solved:
    """Frames that were solved, and how it ended.

    Attributes:
        status: Of the last load step.
        message: For people.
        start: Frame of time 0.
        frames: In order.
        resumed: How many of them an earlier run left.
    """

    status: Status
    message: str
    start: float
    frames: tuple[SolvedFrame, ...]
    resumed: int = 0


def solve_frames(
    bodies: Bodies,
    start: float,
    frames: Sequence[float],
    *,
    method: str = "augmented",
    aitken: bool = False,
    watch: Callable[[SolvedFrame], str | None] | None = None,
    state: Path | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> Solved:
    """Solve contact at frames.

    Args:
        bodies: What may touch, at rest at ``start``.
        start: Frame of time 0, before anything touches or where overlaps begin to be parted (R112).
        frames: Rising, after ``start``.
        method: The solver's; ``aitken`` relaxes the paper's loop.
        watch: Asked after each frame; a text stops the run there (R118).
        state: File that holds what was solved so far; an earlier run's is gone on from.
        progress: Told what is being done, how much of it is done, and how much there is.

    Raises:
        InputError: A state that belongs to something else.
    """
    done: list[SolvedFrame] = []
    after: ContactSolution | None = None
    mark = f"{bodies.body.mesh.nodes.sum():.17g} {len(bodies.pairs)} {start:g} {[float(f) for f in frames]}"
    if state is not None and state.is_file():
        found = load_state(state)
        if found.mark != mark:
            raise InputError("this state belongs to another scene; remove it, or name another after STATE", path=state)
        done, after = list(found.frames), found.solution
        bodies.note(done[-1].nodal)
    resumed = len(done)
    for solved in done:
        reason = watch(solved) if watch else None
        if reason:
            return Solved(Status.STOPPED, reason, start, tuple(done), resumed)
    for frame in frames[len(done) :]:
        progress(f"contact, frame {frame:g}", len(done), len(frames))
        solution = press(
            bodies.body,
            bodies.prescribed,
            bodies.pairs,
            lambda time: bodies.loads,
            times=(frame - start,),
            after=after,
            method=method,
            aitken=aitken,
            tolerance=_TOLERANCE,
            guess=bodies.guess,
            check=False,
        )
        if not solution.converged:
            reason = why_not(bodies, frame - start) or solution.message
            return Solved(solution.status, f"at frame {frame:g}: {reason}", start, tuple(done), resumed)
        after = solution
        solved = solved_frame(float(frame), solution.last)
        bodies.note(solved.nodal)
        done.append(solved)
        if state is not None:
            save_state(state, State(mark, tuple(done), solution))
        reason = watch(solved) if watch else None
        if reason:
            return Solved(Status.STOPPED, reason, start, tuple(done), resumed)
    return Solved(Status.CONVERGED, Status.CONVERGED.value, start, tuple(done), resumed)
