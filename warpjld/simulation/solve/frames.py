"""Frames solved one after another, each kept as soon as it is done (R99, R110, R118)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.fem import Instant, Solution, Status, solve
from warpjld.fem.contact import ContactInstant, ContactSolution, press
from warpjld.simulation.bodies.model import Bodies
from warpjld.simulation.solve.missed_contacts import Brush, brushes_between
from warpjld.simulation.solve.checks import why_not
from warpjld.simulation.solve.branch import TOLERANCE
from warpjld.simulation.solve.solved_frame import SolvedFrame, solved_frame
from warpjld.simulation.solve.identity import differences
from warpjld.simulation.solve.substeps import Passing
from warpjld.simulation.solve.checkpoint import State, load_state, save_state

__all__ = ["Solved", "solve_frames"]

_NAMED = 6
"""Parts that are named of what differs."""


@dataclass(frozen=True, eq=False)
class Solved:
    """Frames that were solved, and how it ended.

    Attributes:
        status: Of the last load step.
        message: For people.
        start: Frame of time 0.
        frames: In order.
        resumed: How many of them an earlier run left.
        brushes: Touches between frames that no frame shows.
    """

    status: Status
    message: str
    start: float
    frames: tuple[SolvedFrame, ...]
    resumed: int = 0
    brushes: tuple[Brush, ...] = ()


def solve_frames(
    bodies: Bodies,
    start: float,
    frames: Sequence[float],
    *,
    method: str = "augmented",
    aitken: bool = False,
    watch: Callable[[SolvedFrame], str | None] | None = None,
    mend: Callable[[ContactSolution, ContactSolution], ContactSolution] | None = None,
    pauses: Mapping[float, Callable[[ContactSolution], None]] | None = None,
    state: Path | None = None,
    identity: Mapping[str, str] | None = None,
    progress: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> Solved:
    """Solve contact at frames.

    Args:
        bodies: What may touch, at rest at ``start``.
        start: Frame of time 0, before anything touches or where overlaps begin to be parted (R112).
        frames: Rising, after ``start``.
        method: The solver's; ``aitken`` relaxes the paper's loop.
        watch: Asked after each frame; a text stops the run there (R118).
        mend: Given the equilibrium before and that of a frame; answers with the one to go on from (R120).
        pauses: Called with the equilibrium of a frame before it is gone on from: they may change what comes.
        state: File that holds what was solved so far; an earlier run's is gone on from.
        identity: What the state belongs to.
        progress: Told what is being done, how much of it is done, and how much there is.

    Raises:
        InputError: A state that belongs to something else.
    """

    def ended(status: Status, message: str) -> Solved:
        return Solved(status, message, start, tuple(done), resumed, tuple(brushes))

    done: list[SolvedFrame] = []
    resumed = 0
    after: ContactSolution | None = None
    passing = Passing(bodies)
    brushes: list[Brush] = []
    mine = dict(identity or {})
    if state is not None and state.is_file():
        found = load_state(state)
        if other := differences(found.identity, mine):
            raise InputError(
                f"this state belongs to another scene: {', '.join(other[:_NAMED])}{' and more' * (len(other) > _NAMED)} "
                "differ; remove it, or name another after STATE",
                path=state,
            )
        done, after = list(found.frames), found.solution
        for one in done:
            bodies.note(one.frame - start, one.displacement, one.reactions, one.nodal)
    resumed = len(done)
    for solved in done:
        reason = watch(solved) if watch else None
        if reason:
            return ended(Status.STOPPED, reason)
    if not bodies.pairs:
        return _alone(bodies, start, frames, watch, progress)
    for frame in frames[len(done) :]:
        progress(f"contact, frame {frame:g}", len(done), len(frames))
        before = 0.0 if after is None else after.last.time
        now = np.zeros_like(bodies.body.mesh.nodes) if after is None else after.last.displacement
        steps = passing.times(before, frame - start, now)
        solution = press(
            bodies.body,
            bodies.prescribed,
            bodies.pairs,
            bodies.loads_at,
            times=steps,
            after=after,
            method=method,
            aitken=aitken,
            tolerance=TOLERANCE,
            guess=bodies.guess,
            check=False,
        )
        if not solution.converged:
            ahead = [why_not(bodies, time) for time in steps if time > solution.last.time]
            reason = next(filter(None, ahead), solution.message)
            return ended(solution.status, f"at frame {frame:g}: {reason}")
        if mend is not None and after is not None:
            solution = mend(after, solution)
        brushes += brushes_between(bodies, None if after is None else after.last, solution.instants, start)
        after = solution
        solved = solved_frame(float(frame), solution.instants)
        bodies.note(frame - start, solved.displacement, solved.reactions, solved.nodal)
        done.append(solved)
        if state is not None:
            save_state(state, State(mine, tuple(done), solution))
        reason = watch(solved) if watch else None
        if reason:
            return ended(Status.STOPPED, reason)
        if pauses and frame in pauses:
            progress(f"looking for a grip, frame {frame:g}", len(done), len(frames))
            pauses[frame](solution)
    return ended(Status.CONVERGED, Status.CONVERGED.value)


def _alone(
    bodies: Bodies,
    start: float,
    frames: Sequence[float],
    watch: Callable[[SolvedFrame], str | None] | None,
    progress: Callable[[str, int, int], None],
) -> Solved:
    """Frames of bodies with nothing to touch."""
    done: list[SolvedFrame] = []
    nothing = np.zeros_like(bodies.body.mesh.nodes)
    rest = Instant(1.0, nothing, nothing, 0, 0, 0.0)
    after, before = Solution(Status.CONVERGED, (rest,), "", np.empty(0, np.int64), bodies.loads), 0.0
    for frame in frames:
        progress(f"frame {frame:g}", len(done), len(frames))
        known = bodies.prescribed(frame - start)
        ahead = bodies.guess(before, frame - start, after.displacement)
        first = replace(after, instants=(replace(after.last, displacement=ahead),), loads=bodies.loads)
        solution = solve(bodies.body, known, bodies.loads, after=first, free="hold", check=False)
        if not solution.converged:
            return Solved(solution.status, f"at frame {frame:g}: {solution.message}", start, tuple(done))
        after, last, before = solution, solution.last, frame - start
        instant = ContactInstant(
            frame - start, last.displacement, last.reactions, (), last.newton, last.iterations, last.residual
        )
        done.append(solved_frame(float(frame), [instant]))
        reason = watch(done[-1]) if watch else None
        if reason:
            return Solved(Status.STOPPED, reason, start, tuple(done))
    return Solved(Status.CONVERGED, Status.CONVERGED.value, start, tuple(done))
