"""Newton's method through load increments, with line search and step halving where full steps fail (R99)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.fem.arrays import Array, Ints, norm
from warpjld.fem.assembly.block_matrix import BlockMatrix, IndefiniteError
from warpjld.fem.body import Tangent
from warpjld.fem.solver.krylov import Iteration, SolveStatus
from warpjld.fem.solver.problem import Problem
from warpjld.fem.solver.solution import Instant, Solution

__all__ = ["Newton"]

_HALVINGS = 8  # largest number of halvings of a load step
_ITERATIONS, _CAUTIOUS = 16, 25  # largest number of iterations of a step: full Newton steps, and with line search
_LINE_SEARCH = 8  # largest number of trial lengths of a Newton step, halved each
_ROUNDING, _PLACES = 1e-13, 0.03
"""As in ``contact.solver.newton_state``."""
_DIRECT = 40_000
"""Number of degrees of freedom up to which a step with an indefinite stiffness is solved directly."""

_BRACKET = 2e-3
"""Relative accuracy of a limit load."""
_SEED, _TESTED = 7, 1e-4
"""Seed of the random load for the stability test, and tolerance of its solve."""

Progress = Callable[[str], None]


class Newton:
    """Newton's method with optional line search.

    Args:
        problem: The problem.
        tolerance: Relative residual of each equilibrium.
        guess: Initial guess of the displacement at the full load [m], shape (N, 3).
    """

    def __init__(self, problem: Problem, tolerance: float, guess: Array | None = None) -> None:
        self._problem = problem
        self._tolerance = tolerance
        self._guess = guess
        self._tangent: Tangent | None = None
        self._indefinite = False

    def run(self, steps: list[float], held: Ints, progress: Progress | None) -> Solution:
        """Find the equilibria at all load factors; a step that fails is halved."""
        u = self._problem.start.copy()
        reached: list[Instant] = []
        factor, halvings, beyond = 0.0, 0, np.inf
        todo = list(steps)
        while todo:
            target = todo[0]
            self._indefinite = False
            status, found = self._from_guess(target)
            if status is not SolveStatus.CONVERGED:
                status, found = self._equilibrium(u, target, cautious=False)
            if status is not SolveStatus.CONVERGED and beyond == np.inf:
                status, found = self._equilibrium(u, target, cautious=True)
            if found is not None and status is SolveStatus.CONVERGED and not self._stable(found, target):
                status, found = SolveStatus.LIMIT_LOAD, None
            if found is None and (self._indefinite or status is SolveStatus.LIMIT_LOAD):
                beyond = min(beyond, target)
            if found is not None and status is SolveStatus.CONVERGED:
                u, factor = found.displacement.reshape(-1), target
                beyond = beyond if factor < beyond else np.inf
                reached.append(found)
                todo.pop(0)
                halvings = max(0, halvings - 1)
                if progress:
                    progress(
                        f"load {target:.3g}: {found.newton} Newton steps, {found.iterations} iterations, "
                        f"residual {found.residual:.1e}"
                    )
                continue
            halvings += 1
            if halvings > _HALVINGS or beyond - factor < _BRACKET * factor:
                message = f"no equilibrium found above load {factor:.4g} (tried {target:.4g}): {status.value}"
                if beyond < np.inf:
                    status, message = SolveStatus.LIMIT_LOAD, _limit_message(factor, beyond)
                instants = tuple(reached) or (self._problem.beginning(),)
                return Solution(status, instants, message, held, self._problem.loads)
            if progress:
                progress(f"load {target:.3g}: {status.value}; halving the step")
            todo.insert(0, 0.5 * (factor + target))
        return Solution(SolveStatus.CONVERGED, tuple(reached), SolveStatus.CONVERGED.value, held, self._problem.loads)

    def _stable(self, found: Instant, target: float) -> bool:
        """Whether the tangent of an equilibrium is positive definite, that is, whether it is stable. Tested by a solve
        with a random load, which excites every mode."""
        problem, u = self._problem, found.displacement.reshape(-1)
        tangent = self._tangent = problem.body.at(u, reuse=self._tangent)
        stiffness = tangent.stiffness
        assert stiffness is not None
        problem.subtract_pressure(stiffness, target, u)
        load = np.random.default_rng(_SEED).standard_normal(u.size)
        try:
            done = problem.solver(stiffness).solve(np.where(problem.free, load, 0.0), tolerance=_TESTED)
        except IndefiniteError:
            return False
        return done.status is not SolveStatus.INDEFINITE

    def _from_guess(self, target: float) -> tuple[SolveStatus, Instant | None]:
        """Equilibrium at the full load from the initial guess, if there is one."""
        if self._guess is None or target != 1.0:
            return SolveStatus.STAGNATED, None
        u = self._guess.astype(np.float64).reshape(-1)
        u[self._problem.prescribed.degrees] = self._problem.known(target)
        if not (self._problem.body.at(u, stiffness=False).lowest > 0).all():
            return SolveStatus.INVERTED, None
        # pressures of the start, since the guess compresses single elements, whose spurious pressures would make K
        # indefinite
        pressures = self._problem.body.at(self._problem.start, stiffness=False).pressures
        return self._equilibrium(u, target, cautious=False, guessed=pressures)

    def _equilibrium(
        self, u: Array, target: float, *, cautious: bool, guessed: Array | None = None
    ) -> tuple[SolveStatus, Instant | None]:
        """Newton's method at one load factor.

        Full steps first: in slender and nearly incompressible bodies the residual increases before it decreases, and a
        line search on it would make tiny steps. Only steps that invert elements are shortened. With ``cautious`` the
        residual must decrease.
        """
        body, free = self._problem.body, self._problem.free
        u = u.copy()
        known = self._problem.prescribed.degrees
        jump = np.zeros_like(u)
        jump[known] = self._problem.known(target) - u[known]
        iterations = 0
        start = 0.0
        pressures = guessed
        for step in range(_CAUTIOUS if cautious else _ITERATIONS):
            tangent = self._tangent = body.at(u, pressures=pressures, reuse=self._tangent)
            stiffness = tangent.stiffness
            assert stiffness is not None
            external = self._problem.external(target, u)
            self._problem.subtract_pressure(stiffness, target, u)
            residual = np.where(free, external - tangent.forces, 0.0)
            now = norm(residual)
            # forces of an inaccurate guess are no scale for equilibrium
            start = max(start, now) if step == 0 and guessed is None else start
            scale = max(start, norm(external), norm(np.where(free, 0.0, tangent.forces - external)), 1e-300)
            moved = not jump.any()
            # for a body moved rigidly all forces vanish: rounding errors scale with stiffness times displacement
            stiff = np.einsum("nii->n", stiffness.diagonal()) / 3.0
            noise = _ROUNDING * (norm(np.repeat(stiff, 3) * u) + _PLACES * norm(stiff) * body.mesh.size)
            if moved and now <= max(self._tolerance * scale, noise):
                reactions = self._problem.reactions(tangent.forces - external)
                return SolveStatus.CONVERGED, Instant(
                    target, u.reshape(-1, 3), reactions, step, iterations, now / scale
                )
            right = residual - stiffness.product(jump, threads=body.threads)
            inner = self._step(stiffness, right, 1e-3 if not moved else 1e-5)
            iterations += inner.iterations
            if inner.status in (SolveStatus.INDEFINITE, SolveStatus.NOT_FINITE):
                return inner.status, None
            direction = inner.x + jump
            length, status = self._line_search(u, direction, target, now if moved and cautious else None)
            if length == 0.0:
                return status, None
            pressures = body.at(u, stiffness=False, increment=length * direction).pressures
            u = u + length * direction
            jump = (1.0 - length) * jump
            if length == 1.0:
                jump[:] = 0.0
                u[known] = self._problem.known(target)
        return SolveStatus.MAX_ITERATIONS, None

    def _line_search(
        self, u: Array, direction: Array, target: float, before: float | None
    ) -> tuple[float, SolveStatus]:
        """Longest step of 1, ½, ¼ … without inverted elements and, if ``before`` is given, with a smaller residual."""
        length, best = 1.0, (np.inf, 0.0)
        upright = False
        for _ in range(_LINE_SEARCH):
            there = u + length * direction
            trial = self._problem.body.at(there, stiffness=False)
            if (trial.lowest > 0).all():
                upright = True
                if before is None:
                    return length, SolveStatus.CONVERGED
                external = self._problem.external(target, there)
                size = norm(np.where(self._problem.free, external - trial.forces, 0.0))
                if size < best[0]:
                    best = (size, length)
                if size < (1.0 - 1e-4 * length) * before:
                    return length, SolveStatus.CONVERGED
            length *= 0.5
        if not upright:
            return 0.0, SolveStatus.INVERTED
        assert before is not None
        if best[0] < 4.0 * before:
            return best[1], SolveStatus.CONVERGED
        return 0.0, SolveStatus.STAGNATED

    def _step(self, stiffness: BlockMatrix, right: Array, tolerance: float) -> Iteration:
        """A Newton step. On the way to a stable equilibrium K may be temporarily indefinite (a slender body before it
        has rotated): conjugate gradients fail then, but a direct solve of moderate size does not.
        """
        try:
            done = self._problem.solver(stiffness).solve(right, tolerance=tolerance)
        except IndefiniteError:
            done = Iteration(np.zeros_like(right), SolveStatus.INDEFINITE, 0, 1.0, np.empty(0))
        self._indefinite |= done.status is SolveStatus.INDEFINITE
        if done.status is SolveStatus.INDEFINITE and int(self._problem.free.sum()) <= _DIRECT:
            return self._problem.direct_solver(stiffness).solve(right)
        return done


def _limit_message(factor: float, target: float) -> str:
    return (
        f"limit load: above {factor:.4g} of the load (tried {target:.4g}) no stable equilibrium was found: the body "
        "buckles, snaps through or collapses there"
    )
