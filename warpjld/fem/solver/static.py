"""Static equilibrium K U = R: linear solves, or Newton's method through load increments (B eq. 5, R99, R107)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints
from warpjld.fem.assembly.block_matrix import IndefiniteError
from warpjld.fem.body import Body
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed, held_in_place, refuse_free
from warpjld.fem.rotation import warn_of_rotation
from warpjld.fem.solver.arc_length import follow
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.fem.solver.newton import Newton
from warpjld.fem.solver.problem import Problem
from warpjld.fem.solver.solution import Instant, Solution, SolveError
from warpjld.runtime.threads import one_blas_thread

__all__ = ["solve"]

_ARC = 0.1
"""Load factor that sets the length of the first arc-length step by default."""
FREE = ("refuse", "hold")


@one_blas_thread()
def solve(
    body: Body,
    prescribed: Prescribed,
    loads: Loads | None = None,
    *,
    after: Solution | None = None,
    guess: Array | None = None,
    instants: int | list[float] = 1,
    free: str = "refuse",
    method: str = "auto",
    precision: str = "float64",
    tolerance: float = 1e-8,
    arc_length: bool = False,
    check: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Solution:
    """Displacements and reactions under loads and prescribed displacements.

    Args:
        body: Mesh and laws.
        prescribed: Known displacements.
        loads: Known forces.
        after: Equilibrium to start from: loads and prescribed displacements change from those there to the given ones,
            and reactions at released degrees of freedom are reduced gradually.
        guess: Initial guess of the displacement at the full load [m], shape (N, 3): start of Newton's method for that
            instant, unless it inverts elements. Not needed for linear laws.
        instants: Load increments, as a number of equal steps or as increasing factors that end with 1; steps that fail
            are halved. One is enough for linear laws.
        free: What to do with a body with free rigid motions: ``refuse`` it, or ``hold`` it by a minimal number of
            constraints (see ``held_in_place``).
        method: Linear solver (see ``LinearSolver``).
        precision: ``float64``, or ``float32`` refined to float64 residuals.
        tolerance: Relative residual of each equilibrium.
        arc_length: Follow the equilibrium path beyond limit loads, where a body buckles or snaps through and the load
            decreases on the way to the full load; equilibria on the path may be unstable. The first of ``instants``
            sets the length of steps.
        check: Whether to raise if the full load is not reached, instead of returning the status.
        progress: Called with a line of text after each instant.

    Raises:
        InputError: Wrong arguments, or a free body (``FreeBodyError``).
        SolveError: The full load was not reached; its ``solution`` holds the equilibria found.
    """
    if free not in FREE:
        raise InputError(f"free: want {' or '.join(FREE)}, got '{free}'")
    steps = _steps(instants)
    if after is not None and after.displacement.size != body.degrees:
        raise InputError(f"after: is of a body with {after.displacement.size} degrees of freedom, not {body.degrees}")
    if guess is not None and guess.size != body.degrees:
        raise InputError(f"guess: want {body.degrees} values, got {guess.size}")
    prescribed, held = _held(body, prescribed, after, free)
    problem = Problem(body, prescribed, loads or Loads(), after, method=method, precision=precision)
    if body.large_strain:
        solution = (
            follow(problem, steps[0] if len(steps) > 1 else _ARC, tolerance, held, progress)
            if arc_length
            else Newton(problem, tolerance, guess).run(steps, held, progress)
        )
    else:
        solution = _linear(problem, steps, tolerance, held, progress)
    warn_of_rotation(body, solution.displacement)
    if check and not solution.converged:
        raise SolveError(solution)
    return solution


def _held(body: Body, prescribed: Prescribed, after: Solution | None, free: str) -> tuple[Prescribed, Ints]:
    """Prescribed displacements with constraints of free bodies added, and the latter's degrees of freedom.

    Raises:
        FreeBodyError: A free body, with ``free="refuse"``.
    """
    if free == "refuse":
        refuse_free(body, prescribed)
        return prescribed, np.empty(0, np.int64)
    wanted = prescribed.degrees
    prescribed = held_in_place(body, prescribed)
    held = np.setdiff1d(prescribed.degrees, wanted)
    if after is not None:
        prescribed.values[np.isin(prescribed.degrees, held)] = after.displacement.reshape(-1)[held]
    return prescribed, held


def _linear(
    problem: Problem, steps: list[float], tolerance: float, held: Ints, progress: Callable[[str], None] | None
) -> Solution:
    """Solution with linear laws: K is constant, so a single set-up serves all instants."""
    body = problem.body
    rest = body.at()
    stiffness = rest.stiffness
    assert stiffness is not None
    try:
        solver = problem.solver(stiffness)
    except IndefiniteError as error:
        return Solution(SolveStatus.INDEFINITE, (problem.beginning(),), str(error), held, problem.loads)
    reached = []
    status, message = SolveStatus.CONVERGED, SolveStatus.CONVERGED.value
    for factor in steps:
        u = np.zeros(body.degrees)
        u[problem.prescribed.degrees] = problem.known(factor)
        external = problem.external(factor, None)
        right = external - rest.forces - stiffness.product(u, threads=body.threads)
        done = solver.solve(right, tolerance=tolerance)
        u = u + done.x
        forces = rest.forces + stiffness.product(u, threads=body.threads)
        reactions = problem.reactions(forces - external)
        reached.append(Instant(factor, u.reshape(-1, 3), reactions, 1, done.iterations, done.residual))
        if progress:
            progress(f"load {factor:.3g}: {done.iterations} iterations, residual {done.residual:.1e}")
        if done.status is not SolveStatus.CONVERGED:
            status, message = done.status, f"at load {factor:g}: {done.status.value} (residual {done.residual:.1e})"
            break
    return Solution(status, tuple(reached), message, held, problem.loads)


def _steps(instants: int | list[float]) -> list[float]:
    if isinstance(instants, int):
        if instants < 1:
            raise InputError(f"instants: want at least one, got {instants}")
        return [(k + 1) / instants for k in range(instants)]
    if not instants or any(b <= a for a, b in zip([0.0, *instants], instants, strict=False)):
        raise InputError(f"instants: want rising factors above 0, got {instants}")
    return [float(f) for f in instants]
