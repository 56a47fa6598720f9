"""Arc-length continuation: equilibrium paths beyond limit loads, with load and displacement as unknowns.

From an equilibrium (u, λ) a step of length |Δu| = s goes along the tangent u' = K⁻¹ ∂R/∂λ, in the direction of the
previous step, and is corrected orthogonally to the step so far: δu = δu_R + δλ u', Δu · δu = 0, with
K δu_R = R(u, λ) (Riks 1979, Int. J. Solids Struct. 15, 529; Ramm 1981). The load may thus decrease beyond a limit
load.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, dot, norm
from warpjld.fem.body import Tangent
from warpjld.fem.solver.krylov import SolveStatus
from warpjld.fem.solver.problem import Problem
from warpjld.fem.solver.solution import Instant, Solution

__all__ = ["DIRECT", "follow"]

DIRECT = 40_000
"""Largest number of degrees of freedom: steps need a direct solver, since the stiffness is indefinite."""
_STEPS = 300  # largest number of steps of a path
_ITERATIONS, _FEW = 12, 4  # largest number of iterations of a step; with at most `_FEW` the next step is longer
_SHORTER, _LONGER, _LONGEST = 0.5, 1.5, 4.0  # factors of the step length; largest length, per first length
_SHORTEST = 1e-4
"""Smallest step length, per first length; below, the path is given up."""


def follow(
    problem: Problem, first: float, tolerance: float, held: Ints, progress: Callable[[str], None] | None
) -> Solution:
    """Equilibria along the path until the full load is reached; the load may rise and fall.

    Args:
        problem: The problem.
        first: Load factor that sets the length of the first step.
        tolerance: Relative residual of each equilibrium.
        held: Degrees of freedom that were constrained because a body was free.
        progress: Called with a line of text after each instant.

    Raises:
        InputError: Too many degrees of freedom.
    """
    if int(problem.free.sum()) > DIRECT:
        raise InputError(f"arc_length: want {DIRECT} free degrees of freedom at most, got {int(problem.free.sum())}")
    path = _Path(problem, tolerance)
    u, factor, reached, limit = problem.start.copy(), 0.0, [problem.beginning()], 0.0
    way = np.zeros_like(u)
    length = longest = 0.0
    for _ in range(_STEPS):
        slope = path.slope(u, factor)
        if slope is None:
            break
        if length == 0.0:
            length = first * norm(slope)
            longest = _LONGEST * length
        sign = -1.0 if dot(way, slope) < 0.0 else 1.0
        ahead = sign * length / norm(slope)
        full = factor + ahead >= 1.0
        ahead = 1.0 - factor if full else ahead
        found = path.corrected(u, factor, ahead * slope, ahead, fixed=full)
        if found is None:
            length *= _SHORTER
            if length < _SHORTEST * longest / _LONGEST:
                break
            continue
        there, now, instant = found
        way, u, factor = there - u, there, now
        limit = max(limit, factor)
        reached.append(instant)
        length = min(longest, length * (_LONGER if instant.newton <= _FEW else 1.0))
        if progress:
            progress(f"load {factor:.4g}: {instant.newton} Newton steps, residual {instant.residual:.1e}")
        if full:
            text = "" if len(reached) < 2 else _limit_message([i.factor for i in reached])
            return Solution(SolveStatus.CONVERGED, tuple(reached[1:]), text or "converged", held, problem.loads)
    message = f"the path could not be followed to the full load: it got to {factor:.4g}, at most to {limit:.4g} of it"
    return Solution(SolveStatus.MAX_ITERATIONS, tuple(reached[1:] or reached), message, held, problem.loads)


def _limit_message(factors: list[float]) -> str:
    """Message on the largest limit load on the path; empty without one."""
    peaks = [b for a, b, c in zip(factors, factors[1:], factors[2:], strict=False) if a < b > c]
    return f"converged, beyond a limit load of {max(peaks):.4g} of the load" if peaks else ""


class _Path:
    """Predictor and corrector of steps along the path."""

    def __init__(self, problem: Problem, tolerance: float) -> None:
        self._problem, self._tolerance = problem, tolerance
        self._tangent: Tangent | None = None
        self._full = np.zeros_like(problem.start)
        self._full[problem.prescribed.degrees] = problem.known(1.0) - problem.known(0.0)

    def slope(self, u: Array, factor: float) -> Array | None:
        """Tangent ∂u/∂λ at fixed residual, shape (3N,)."""
        return self._solve(u, factor, np.zeros_like(u))[1]

    def _solve(self, u: Array, factor: float, residual: Array) -> tuple[Array | None, Array | None]:
        """Solutions K⁻¹ R and ∂u/∂λ."""
        problem = self._problem
        self._tangent = problem.body.at(u, reuse=self._tangent)
        stiffness = self._tangent.stiffness
        assert stiffness is not None
        problem.subtract_pressure(stiffness, factor, u)
        solver = problem.direct_solver(stiffness)
        more = problem.external(1.0, u) - problem.external(0.0, u)
        right = np.where(problem.free, more - stiffness.product(self._full, threads=problem.body.threads), 0.0)
        one, two = (solver.solve(part) if part.any() else None for part in (residual, right))
        if any(part is not None and not np.isfinite(part.x).all() for part in (one, two)):
            return None, None
        return (np.zeros_like(u) if one is None else one.x), self._full + (0.0 if two is None else two.x)

    def corrected(
        self, start: Array, factor: float, way: Array, ahead: float, *, fixed: bool
    ) -> tuple[Array, float, Instant] | None:
        """The equilibrium near a predictor step ``way`` (3N,) and load increment ``ahead``, at that load if ``fixed``;
        None if the iteration does not converge."""
        problem, load = self._problem, factor + ahead
        for step in range(_ITERATIONS):
            u = start + way
            state = problem.body.at(u, stiffness=False)
            if not (state.lowest > 0.0).all() or not np.isfinite(state.forces).all():
                return None
            external = problem.external(load, u)
            residual = np.where(problem.free, external - state.forces, 0.0)
            scale = max(norm(external), norm(np.where(problem.free, 0.0, state.forces - external)), 1e-300)
            left = norm(residual) / scale
            if left <= self._tolerance:
                reactions = problem.reactions(state.forces - external)
                return u, load, Instant(load, u.reshape(-1, 3), reactions, step, 0, left)
            move, slope = self._solve(u, load, residual)
            if move is None or slope is None:
                return None
            across = dot(way, slope)
            change = 0.0 if fixed or across == 0.0 else -dot(way, move) / across
            way, load = way + move + change * slope, load + change
        return None
