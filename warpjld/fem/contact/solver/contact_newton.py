"""Newton's method for one load step, bodies and contact together (algorithm: ``contact.solver``)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.assembly.block_matrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.solver.contact_system import ContactSystem, LoadStep
from warpjld.fem.contact.solver.damping import Damping
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.lagged_solver import LaggedSolver
from warpjld.fem.contact.solver.line_search import length_by_residual, length_by_work, length_upright
from warpjld.fem.contact.solver.newton_state import Equilibrium, NewtonState, guess_held
from warpjld.fem.contact.solver.tangent import with_contact
from warpjld.fem.contact.solver.unconstrained import UnconstrainedBodies
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.krylov import Iteration, SolveStatus

__all__ = ["ContactNewton"]

_ITERATIONS = 40
"""Most Newton iterations of a search."""
_PENALTY = 200.0
"""Penalty ε times edge over E*: a larger one makes linear solves slower, a smaller one makes more of them necessary."""
_STRIDE = 0.25
"""Largest displacement of a node in an iteration with active contact, over the search distance (two edges)."""
_FALLS = 8
"""Most successive iterations in which an unconstrained body may have no contact."""
_RESTARTS = 2
"""Most continuations of a search after contact points searched again did not agree; more of them cycle."""
_HOPELESS, _FAR = 10, 0.3
"""Iteration at which a search is abandoned if its relative residual was never below the second number. Of 225 converged
searches in grasps none would have been abandoned; 381 of 1,615 futile iterations were saved. Not used for bodies held
by contact alone, on which forces are small and balance last, unless the caller tries a shorter step: of 34 searches of
two lifts with more than 6 iterations, the 22 that converged were at 0.24 or less by then (21 of them at 0.02), and 6 of
the 12 others above 0.3."""
_LOST, _NEAR = 20, 0.05
"""The same for bodies held by contact alone; searches beyond that seldom converge, and shorter steps take fewer."""
_STALLED, _LESS = 12, 0.9
"""Iterations after which a search is abandoned if the relative residual has not fallen below the second number times
its least value meanwhile. Of 49 converged searches in grasps none waited for more than 6; those that ended at the limit
of iterations had waited for 29 and more. Not used for bodies held by contact alone."""

_SAME = 1e-10
"""Largest difference of a guess, over the bodies' size, that is none."""


class ContactNewton:
    """Newton solver of a contact problem; keeps matrices and preconditioners between load steps.

    Args:
        body: All bodies, merged.
        interfaces: Contact interfaces.
        moduli: Contact modulus E* at each interface's slave nodes [Pa].
        tolerance: Relative residual.
        penetration: Admissible penetration, relative to an element edge.

    Attributes:
        solves: Number of linear solves so far.
        iterations: Number of their iterations.
        most: Most Newton iterations of a search.
        once: Whether a failed search from a guess is the last one: the caller tries another step.
        allowed: Number of linear solves from which on a search ends.
        failure: Reason why no equilibrium was found; empty if not known.
    """

    def __init__(
        self, body: Body, interfaces: list[Interface], moduli: list[Array], *, tolerance: float, penetration: float
    ) -> None:
        self.body = body
        self.solves = self.iterations = 0
        self.failure, self.most, self.allowed, self.once = "", _ITERATIONS, np.inf, False
        self._accuracy = {"tolerance": tolerance, "penetration": penetration}
        self._free: tuple[bytes, UnconstrainedBodies] | None = None
        self._elastic = Elastic(body)
        self._solver = LaggedSolver(body, "float64")
        self._damping = Damping(body)
        self._system = ContactSystem(body.mesh.nodes, interfaces, moduli, penalty=_PENALTY, penetration=penetration)

    def find(
        self, u: Array, states: list[ContactState], step: LoadStep, *guesses: Array
    ) -> tuple[SolveStatus, Equilibrium | None]:
        """Equilibrium of a load step from displacement u (3N,) and contact states at ``step.before``.

        The search starts from the guess with the smallest residual among those without inverted elements; if it fails
        or there is none, from u, with the Dirichlet values applied in the first Newton step (after a failure not with
        ``once``).
        """
        begun = [
            NewtonState(self._elastic, self._system, step, u, states, guess, **self._accuracy)
            for guess in guesses
            if self._elastic.upright(guess_held(step, guess))
        ]
        begun.sort(key=NewtonState.left_over)
        status, found = SolveStatus.MAX_ITERATIONS, None
        # a guess equal to u, with its Dirichlet values, would repeat the same search
        same = bool(begun) and float(np.abs(begun[0].u - u).max()) <= _SAME * self.body.mesh.size
        if begun:
            status, found = self._search(begun[0], step)
        again = not (begun and (same or self.once))
        if found is None and again and status not in (SolveStatus.UNHELD, SolveStatus.SLIDING):
            state = NewtonState(self._elastic, self._system, step, u, states, None, **self._accuracy)
            other, found = self._search(state, step)
            status = status if begun and found is None else other
        return status, found

    def _search(self, state: NewtonState, step: LoadStep) -> tuple[SolveStatus, Equilibrium | None]:
        """Newton iterations from a state (steps 1–5 of the algorithm)."""
        unconstrained = self._unconstrained(step)
        self._solver.begin()
        self._damping.begin()
        falls, nearest, least, stalled = 0, np.inf, np.inf, 0
        for turn in range(self.most):
            state.assemble()
            if state.balanced():
                if state.confirmed():
                    return SolveStatus.CONVERGED, state.equilibrium()
                if state.restarts > _RESTARTS:
                    break
                least, stalled = np.inf, 0
                continue
            if not np.isfinite(state.unbalanced):
                return SolveStatus.NOT_FINITE, None
            nearest = min(nearest, state.unbalanced)
            far = turn >= _HOPELESS and nearest > _FAR and (self.once or not unconstrained)
            far = far or (turn >= _LOST and nearest > _NEAR and bool(unconstrained))
            least, stalled = (state.unbalanced, 0) if state.unbalanced < _LESS * least else (least, stalled + 1)
            if far or (stalled >= _STALLED and not unconstrained):
                break
            if self.solves >= self.allowed:
                return SolveStatus.EXHAUSTED, None
            state.linearise()
            done = self._solved(state, unconstrained)
            if done.status in (SolveStatus.INDEFINITE, SolveStatus.NOT_FINITE):
                status, self.failure = unconstrained.failure(self._system.interfaces, state.contact)
                return status if status is SolveStatus.UNHELD else done.status, None
            if self._advance(state, done.x + state.jump, unconstrained) == 0.0:
                if not self._damping.more():
                    return SolveStatus.INVERTED, None
                continue
            falls = falls + 1 if unconstrained.falling(state.contact).any() else 0
            if falls > _FALLS:
                break
        status, self.failure = unconstrained.failure(self._system.interfaces, state.contact)
        if status is SolveStatus.MAX_ITERATIONS and self._damping.share > 0.0:
            status = SolveStatus.INDEFINITE
        return status, None

    def _solved(self, state: NewtonState, unconstrained: UnconstrainedBodies) -> Iteration:
        """Free displacements of a Newton step, with as much damping as a positive definite matrix needs.

        Bodies held by contact alone are stabilised as long as contact does not resist all their rigid motions.
        """
        if unconstrained and self._damping.share == 0.0 and unconstrained.grasped(state.contact):
            done = self._solved_with(state, lambda matrix: matrix)
            if done.status is not SolveStatus.INDEFINITE:
                return done
        return self._damping.until_definite(
            lambda: self._solved_with(state, lambda matrix: unconstrained.steadied(matrix, state.turn))
        )

    def _solved_with(self, state: NewtonState, steadied: Callable[[BlockMatrix], BlockMatrix]) -> Iteration:
        """Free displacements of a Newton step with the current damping and a function that stabilises the matrix."""
        contact, stiffness = state.contact, state.tangent.stiffness
        assert stiffness is not None
        blocks = [t.blocks for t in contact.tractions]
        lent = self._damping.lend(stiffness)
        matrix = steadied(with_contact(lent, contact.points, blocks, threads=self.body.threads))
        if state.step.inertia is not None:
            matrix = state.step.inertia.added_to(matrix)
        if (drag := state.step.dragged) is not None:
            matrix = matrix.with_diagonal(drag)
        right = state.residual - matrix.product(state.jump, threads=self.body.threads)
        if contact.nonsymmetric is not None:
            right -= state.free * (contact.nonsymmetric @ state.jump)
        done = self._solver.solve(matrix, state.free, right, contact.nonsymmetric)
        self.solves += 1
        self.iterations += done.iterations
        return done

    def _advance(self, state: NewtonState, move: Array, unconstrained: UnconstrainedBodies) -> float:
        """Advance along a Newton step (3N,) by the step length found; returns that length, 0 … 1."""
        stride = self._stride(state, move, unconstrained)
        move *= stride
        length = self._length(state, move, unconstrained)
        if length > 0.0:
            if state.arrived:
                self._damping.judge(stride * length)
            state.advance(move, length)
        return length

    def _stride(self, state: NewtonState, move: Array, unconstrained: UnconstrainedBodies) -> float:
        """Fraction of a Newton step (3N,) allowed by the search distance of contact; 1 until Dirichlet values are
        reached."""
        if not state.arrived:
            return 1.0
        reach = self._system.reach
        stride = unconstrained.within(move, reach)
        if any(t.active.any() for t in state.contact.tractions):
            stride = min(stride, _STRIDE * reach / max(float(np.abs(move).max()), 1e-300))
        return stride

    def _length(self, state: NewtonState, move: Array, unconstrained: UnconstrainedBodies) -> float:
        """Step length along a move (3N,), 0 … 1; 0 if elements invert however short it is."""
        length = length_upright(self._elastic, state.u, move, state.tangent.lowest)
        if length == 0.0:
            return 0.0
        settling = state.arrived and state.alternating
        watched = state.free if settling else state.free & np.repeat(unconstrained.falling(state.contact), 3)
        length = length_by_work(state, move, length, watched)
        if settling and state.contact.nonsymmetric is not None:
            length = length_by_residual(state, move, length)
        return length

    def _unconstrained(self, step: LoadStep) -> UnconstrainedBodies:
        """Bodies that nothing but contact holds; none with inertia or drag, which resist every motion."""
        known = step.prescribed
        if step.inertia is not None or step.loads.drag is not None:
            known = Prescribed(np.arange(self.body.degrees), np.zeros(self.body.degrees))
        key = known.degrees.tobytes()
        if self._free is None or self._free[0] != key:
            self._free = (key, UnconstrainedBodies(self.body, known, self._elastic.stiffness))
        return self._free[1]
