"""Static equilibrium K U = R: one linear solve, or Newton's method through load instants (B eq. 5, R99, R107)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.blockmatrix import BlockMatrix
from warpjld.fem.body import Body, Tangent
from warpjld.fem.conjugate import Iteration, Status
from warpjld.fem.dots import norm
from warpjld.fem.indefinite import IndefiniteError
from warpjld.fem.linear import LinearSolver
from warpjld.fem.loads import Loads, external_forces, subtract_pressure_stiffness
from warpjld.fem.prescribed import Prescribed, held_in_place, refuse_free
from warpjld.fem.solution import Instant, Solution, SolveError

__all__ = ["solve"]

FREE = ("refuse", "hold")
_HALVINGS = 8
_NEWTON = 16
_CAUTIOUS = 25
_LINE_SEARCH = 8
_ROUNDING, _PLACES = 1e-13, 0.03
"""As in ``contact.equilibrium``."""
_DIRECT = 40_000
"""Degrees of freedom up to which a step with an indefinite stiffness is solved directly."""


def solve(
    body: Body,
    prescribed: Prescribed,
    loads: Loads | None = None,
    *,
    after: Solution | None = None,
    guess: NDArray[np.float64] | None = None,
    instants: int | list[float] = 1,
    free: str = "refuse",
    method: str = "auto",
    precision: str = "float64",
    tolerance: float = 1e-8,
    check: bool = True,
    progress: Callable[[str], None] | None = None,
) -> Solution:
    """Displacements and reactions under loads and prescribed displacements.

    Args:
        body: Mesh and laws.
        prescribed: Known displacements.
        loads: Known forces.
        after: Equilibrium to start from: loads and prescribed displacements go from what they were there to what is
            given here, and degrees of freedom that are released let go of their reactions gradually.
        guess: First guess of the displacement at the full load [m], shape (N, 3): where Newton's method for that
            instant starts, if no element is inside out there. Linear laws need none.
        instants: Load instants, as a number of equal steps or as rising factors that end with 1; steps that fail are
            halved. One is enough for linear laws.
        free: What to do with a body that can move as a whole: ``refuse`` it, or ``hold`` it by as few degrees
            of freedom as possible (``held_in_place`` states the rule).
        method: Linear solver (see ``LinearSolver``).
        precision: ``float64``, or ``float32`` refined to float64 residuals.
        tolerance: Relative residual of each equilibrium.
        check: Raise when the full load is not reached; otherwise return the status.
        progress: Called with a line of text after each instant.

    Raises:
        InputError: Wrong arguments, or a free body (``FreeBodyError``).
        SolveError: The full load was not reached; its ``solution`` has what was.
    """
    if free not in FREE:
        raise InputError(f"free: want {' or '.join(FREE)}, got '{free}'")
    steps = _steps(instants)
    if after is not None and after.displacement.size != body.degrees:
        raise InputError(f"after: is of a body with {after.displacement.size} degrees of freedom, not {body.degrees}")
    held = np.empty(0, np.int64)
    if free == "hold":
        wanted = prescribed.degrees
        prescribed = held_in_place(body, prescribed)
        held = np.setdiff1d(prescribed.degrees, wanted)
        if after is not None:
            prescribed.values[np.isin(prescribed.degrees, held)] = after.displacement.reshape(-1)[held]
    else:
        refuse_free(body, prescribed)
    if guess is not None and guess.size != body.degrees:
        raise InputError(f"guess: want {body.degrees} values, got {guess.size}")
    problem = _Problem(body, prescribed, loads or Loads(), after, method, precision, tolerance)
    problem.guess = guess
    run = problem.newton if body.large_strain else problem.linear
    solution = run(steps, held, progress)
    if check and not solution.converged:
        raise SolveError(solution)
    return solution


class _Problem:
    def __init__(
        self,
        body: Body,
        prescribed: Prescribed,
        loads: Loads,
        after: Solution | None,
        method: str,
        precision: str,
        tolerance: float,
    ) -> None:
        self.body = body
        self.prescribed = prescribed
        self.loads = loads
        self.after = after
        self.start = np.zeros(body.degrees) if after is None else after.displacement.reshape(-1)
        self.options: dict[str, Any] = {
            "method": method,
            "precision": precision,
            "threads": body.threads,
            "poisson": body.poisson,
        }
        self.tolerance = tolerance
        self.free = prescribed.free(body.degrees)
        self.hierarchy: list[Any] | None = None
        self.tangent: Tangent | None = None
        self.guess: NDArray[np.float64] | None = None

    def known(self, factor: float) -> NDArray[np.float64]:
        """Prescribed displacements at an instant, from where they started, shape (n,)."""
        start: NDArray[np.float64] = self.start[self.prescribed.degrees]
        return start + factor * (self.prescribed.values - start)

    def external(self, factor: float, u: NDArray[np.float64] | None) -> NDArray[np.float64]:
        """Nodal forces at an instant, at a displacement (at rest for linear laws), shape (3N,)."""
        forces = factor * external_forces(self.body, self.loads, u)
        if self.after is not None and factor != 1.0:
            before = external_forces(self.body, self.after.loads, u) + self.after.reactions.reshape(-1)
            forces += (1.0 - factor) * before
        return forces

    def subtract_pressure(self, stiffness: BlockMatrix, factor: float, u: NDArray[np.float64]) -> None:
        subtract_pressure_stiffness(stiffness, self.body, self.loads, u, factor)
        if self.after is not None and factor != 1.0:
            subtract_pressure_stiffness(stiffness, self.body, self.after.loads, u, 1.0 - factor)

    def linear(self, steps: list[float], held: NDArray[np.int64], progress: Callable[[str], None] | None) -> Solution:
        """K is the same at every instant: one solve, scaled."""
        body = self.body
        rest = body.at()
        stiffness = rest.stiffness
        assert stiffness is not None
        try:
            solver = self._solver(stiffness)
        except IndefiniteError as error:
            return Solution(Status.INDEFINITE, (self._rest(),), str(error), held, self.loads)
        reached = []
        status, message = Status.CONVERGED, Status.CONVERGED.value
        for factor in steps:
            u = np.zeros(body.degrees)
            u[self.prescribed.degrees] = self.known(factor)
            external = self.external(factor, None)
            right = external - rest.forces - stiffness.product(u, threads=body.threads)
            done = solver.solve(right, tolerance=self.tolerance)
            u = u + done.x
            forces = rest.forces + stiffness.product(u, threads=body.threads)
            reactions = np.where(self.free, 0.0, forces - external)
            reached.append(
                Instant(factor, u.reshape(-1, 3), reactions.reshape(-1, 3), 1, done.iterations, done.residual)
            )
            if progress:
                progress(f"load {factor:.3g}: {done.iterations} iterations, residual {done.residual:.1e}")
            if done.status is not Status.CONVERGED:
                status, message = done.status, f"at load {factor:g}: {done.status.value} (residual {done.residual:.1e})"
                break
        return Solution(status, tuple(reached), message, held, self.loads)

    def newton(self, steps: list[float], held: NDArray[np.int64], progress: Callable[[str], None] | None) -> Solution:
        """Newton with line search; an instant that fails is tried again at half the step."""
        u = self.start.copy()
        reached: list[Instant] = []
        factor, halvings = 0.0, 0
        todo = list(steps)
        while todo:
            target = todo[0]
            status, found = self._from_guess(target)
            if status is not Status.CONVERGED:
                status, found = self._equilibrium(u, target, cautious=False)
            if status is not Status.CONVERGED:
                status, found = self._equilibrium(u, target, cautious=True)
            if found is not None and status is Status.CONVERGED:
                u, factor = found.displacement.reshape(-1), target
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
            if halvings > _HALVINGS:
                message = f"no equilibrium found above load {factor:.4g} (tried {target:.4g}): {status.value}"
                return Solution(status, tuple(reached) or (self._rest(),), message, held, self.loads)
            if progress:
                progress(f"load {target:.3g}: {status.value}; halving the step")
            todo.insert(0, 0.5 * (factor + target))
        return Solution(Status.CONVERGED, tuple(reached), Status.CONVERGED.value, held, self.loads)

    def _from_guess(self, target: float) -> tuple[Status, Instant | None]:
        """The full load's equilibrium from a first guess of it, where there is one."""
        if self.guess is None or target != 1.0:
            return Status.STAGNATED, None
        u = self.guess.astype(np.float64).reshape(-1)
        u[self.prescribed.degrees] = self.known(target)
        if not (self.body.at(u, stiffness=False).lowest > 0).all():
            return Status.INVERTED, None
        # a guess squeezes elements here and there: their false pressures would make K indefinite, those of the
        # equilibrium before do not
        pressures = self.body.at(self.start, stiffness=False).pressures
        return self._equilibrium(u, target, cautious=False, guessed=pressures)

    def _equilibrium(
        self, u: NDArray[np.float64], target: float, *, cautious: bool, guessed: NDArray[np.float64] | None = None
    ) -> tuple[Status, Instant | None]:
        """Newton's method at one load.

        Full steps first: in slender and nearly incompressible bodies the residual rises before it falls, and a search
        that forbids it would creep. Only steps that turn elements inside out are shortened. ``cautious`` then insists
        on a falling residual.
        """
        body, free = self.body, self.free
        u = u.copy()
        known = self.prescribed.degrees
        jump = np.zeros_like(u)
        jump[known] = self.known(target) - u[known]
        iterations = 0
        start = 0.0
        pressures = guessed
        for step in range(_CAUTIOUS if cautious else _NEWTON):
            tangent = self.tangent = body.at(u, pressures=pressures, reuse=self.tangent)
            stiffness = tangent.stiffness
            assert stiffness is not None
            external = self.external(target, u)
            self.subtract_pressure(stiffness, target, u)
            residual = np.where(free, external - tangent.forces, 0.0)
            now = norm(residual)
            # forces of a guess that is off are no measure of those in equilibrium
            start = max(start, now) if step == 0 and guessed is None else start
            scale = max(start, norm(external), norm(np.where(free, 0.0, tangent.forces - external)), 1e-300)
            moved = not jump.any()
            # a body that is carried along as a whole ends without a force: of stiffness times place, this much is noise
            stiff = np.einsum("nii->n", stiffness.diagonal()) / 3.0
            noise = _ROUNDING * (norm(np.repeat(stiff, 3) * u) + _PLACES * norm(stiff) * body.mesh.size)
            if moved and now <= max(self.tolerance * scale, noise):
                reactions = np.where(free, 0.0, tangent.forces - external).reshape(-1, 3)
                return Status.CONVERGED, Instant(target, u.reshape(-1, 3), reactions, step, iterations, now / scale)
            right = residual - stiffness.product(jump, threads=body.threads)
            inner = self._step(stiffness, right, 1e-3 if not moved else 1e-5)
            iterations += inner.iterations
            if inner.status in (Status.INDEFINITE, Status.NOT_FINITE):
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
                u[known] = self.known(target)
        return Status.MAX_ITERATIONS, None

    def _line_search(
        self, u: NDArray[np.float64], direction: NDArray[np.float64], target: float, before: float | None
    ) -> tuple[float, Status]:
        """Longest of 1, ½, ¼ … that keeps elements upright and, where ``before`` is given, lowers the residual."""
        length, best = 1.0, (np.inf, 0.0)
        upright = False
        for _ in range(_LINE_SEARCH):
            there = u + length * direction
            trial = self.body.at(there, stiffness=False)
            if (trial.lowest > 0).all():
                upright = True
                if before is None:
                    return length, Status.CONVERGED
                external = self.external(target, there)
                size = norm(np.where(self.free, external - trial.forces, 0.0))
                if size < best[0]:
                    best = (size, length)
                if size < (1.0 - 1e-4 * length) * before:
                    return length, Status.CONVERGED
            length *= 0.5
        if not upright:
            return 0.0, Status.INVERTED
        assert before is not None
        if best[0] < 4.0 * before:
            return best[1], Status.CONVERGED
        return 0.0, Status.STAGNATED

    def _step(self, stiffness: BlockMatrix, right: NDArray[np.float64], tolerance: float) -> Iteration:
        """One Newton step. On the way to a stable equilibrium K may be indefinite for a while (a slender body pushed
        before it has turned): conjugate gradients cannot pass there, a direct solve of moderate size can.
        """
        try:
            done = self._solver(stiffness).solve(right, tolerance=tolerance)
        except IndefiniteError:
            done = Iteration(np.zeros_like(right), Status.INDEFINITE, 0, 1.0, np.empty(0))
        if done.status is Status.INDEFINITE and int(self.free.sum()) <= _DIRECT:
            direct = {**self.options, "method": "direct"}
            return LinearSolver(stiffness, self.free, self.body.mesh, definite=False, **direct).solve(right)
        return done

    def _solver(self, stiffness: BlockMatrix) -> LinearSolver:
        solver = LinearSolver(stiffness, self.free, self.body.mesh, hierarchy=self.hierarchy, **self.options)
        self.hierarchy = solver.hierarchy
        return solver

    def _rest(self) -> Instant:
        nothing = np.zeros((self.body.degrees // 3, 3))
        reactions = nothing if self.after is None else self.after.reactions
        return Instant(0.0, self.start.reshape(-1, 3), reactions, 0, 0, 0.0)


def _steps(instants: int | list[float]) -> list[float]:
    if isinstance(instants, int):
        if instants < 1:
            raise InputError(f"instants: want at least one, got {instants}")
        return [(k + 1) / instants for k in range(instants)]
    if not instants or any(b <= a for a, b in zip([0.0, *instants], instants, strict=False)):
        raise InputError(f"instants: want rising factors above 0, got {instants}")
    return [float(f) for f in instants]
