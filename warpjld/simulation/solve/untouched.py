"""Frames of a model without contact pairs, solved by the static solver."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from warpjld.fem import Instant, Solution, SolveStatus, solve
from warpjld.fem.contact import ContactInstant
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.bodies.model import ContactModel
from warpjld.simulation.solve.solved_frame import SolvedFrame, solved_frame

__all__ = ["solve_untouched"]


def solve_untouched(
    model: ContactModel,
    frames: Sequence[float],
    done: list[SolvedFrame],
    watch: Callable[[ContactModel, SolvedFrame], str | None],
    progress: Callable[[str, int, int], None],
) -> tuple[SolveStatus, str]:
    """Solve frames one after another and append them to ``done``; returns status and message (see ``solve_frames``)."""
    zero, history = np.zeros_like(model.body.mesh.nodes), History()
    rest = Instant(1.0, zero, zero, 0, 0, 0.0)
    loads = model.loads_at(0.0, history)
    after, before = Solution(SolveStatus.CONVERGED, (rest,), "", np.empty(0, np.int64), loads), 0.0
    for frame in frames:
        progress(f"frame {frame:g}", len(done), len(frames))
        time = frame - model.start
        known = model.prescribed(time, history)
        ahead = model.guess(before, time, after.displacement, history)
        loads = model.loads_at(time, history)
        first = replace(after, instants=(replace(after.last, displacement=ahead),), loads=loads)
        solution = solve(model.body, known, loads, after=first, free="hold", check=False)
        if not solution.converged:
            return solution.status, f"at frame {frame:g}: {solution.message}"
        after, last, before = solution, solution.last, time
        instant = ContactInstant(
            time, last.displacement, last.reactions, (), last.newton, last.iterations, last.residual
        )
        done.append(solved_frame(float(frame), [instant]))
        if reason := watch(model, done[-1]):
            return SolveStatus.STOPPED, reason
    return SolveStatus.CONVERGED, SolveStatus.CONVERGED.value
