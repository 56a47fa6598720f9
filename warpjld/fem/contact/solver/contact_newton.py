"""Newton's method for one load step, on bodies and contact together (see ``contact.solver`` for the algorithm)."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.assembly.block_matrix import IndefiniteError
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
_PENALTY = 200.0
"""Contact stiffness over E* by the edge of a face: more makes the linear solves slow, less makes them many."""
_STRIDE = 0.25
"""Farthest a node moves in an iteration where something presses, over what points look ahead (two edges)."""
_FALLS = 8
"""Iterations in a row that an unconstrained body may fall for, with nothing touching it."""
_RESTARTS = 2
"""Times that a search may go on with points found afresh: one that comes to the same place again goes round."""
_HOPELESS, _FAR = 10, 0.3
"""A search is ended at that iteration if what is left over was never below this share of the forces that balance. Of
225 searches of grasps that converged none would have been; of 1,615 iterations in vain 381 were saved. Not where bodies
are held by contact alone: forces on them are slight, and balance last, as long as they find their place."""


class ContactNewton:
    """The bodies and interfaces of a contact problem, and the matrices kept between steps.

    Args:
        body: All bodies, merged.
        interfaces: What may touch.
        moduli: E* at each interface's slave nodes [Pa].
        tolerance: Relative residual.
        penetration: Overlap left, as a share of an edge.

    Attributes:
        solves: Linear solves so far.
        iterations: Their iterations.
        failure: Why no equilibrium was found, where that is known.
    """

    def __init__(
        self, body: Body, interfaces: list[Interface], moduli: list[Array], *, tolerance: float, penetration: float
    ) -> None:
        self.body = body
        self.solves = self.iterations = 0
        self.failure = ""
        self._accuracy = {"tolerance": tolerance, "penetration": penetration}
        self._free: tuple[bytes, UnconstrainedBodies] | None = None
        self._elastic = Elastic(body)
        self._solver = LaggedSolver(body, "float64")
        self._damping = Damping(body)
        self._system = ContactSystem(body.mesh.nodes, interfaces, moduli, penalty=_PENALTY, penetration=penetration)

    def find(
        self, u: Array, states: list[ContactState], step: LoadStep, *guesses: Array
    ) -> tuple[SolveStatus, Equilibrium | None]:
        """Equilibrium from displacement u (3N,) at ``step.before``.

        It is looked for from the guess that turns no element inside out and leaves the least force over; where that is
        in vain, and where there is none, from u, what is prescribed yet to go to its place.
        """
        begun = [
            NewtonState(self._elastic, self._system, step, u, states, guess, **self._accuracy)
            for guess in guesses
            if self._elastic.upright(guess_held(step, guess))
        ]
        begun.sort(key=NewtonState.left_over)
        status, found = SolveStatus.MAX_ITERATIONS, None
        if begun:
            status, found = self._search(begun[0], step)
        if found is None and status not in (SolveStatus.UNHELD, SolveStatus.SLIDING):
            again, found = self._search(
                NewtonState(self._elastic, self._system, step, u, states, None, **self._accuracy), step
            )
            status = status if begun and found is None else again
        return status, found

    def _search(self, state: NewtonState, step: LoadStep) -> tuple[SolveStatus, Equilibrium | None]:
        """Equilibrium from where a state is."""
        unconstrained = self._unconstrained(step.prescribed)
        self._solver.begin()
        self._damping.begin()
        falls, nearest = 0, np.inf
        for turn in range(_ITERATIONS):
            state.assemble()
            if state.balanced():
                if state.confirmed():
                    return SolveStatus.CONVERGED, state.equilibrium()
                if state.restarts > _RESTARTS:
                    break
                continue
            if not np.isfinite(state.unbalanced):
                return SolveStatus.NOT_FINITE, None
            nearest = min(nearest, state.unbalanced)
            if turn >= _HOPELESS and nearest > _FAR and not unconstrained:
                break
            state.linearise()
            done = self._solved(state, unconstrained)
            if done.status in (SolveStatus.INDEFINITE, SolveStatus.NOT_FINITE):
                return done.status, None
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
        """A Newton step's free displacements; damped as far as the matrix needs it to be positive definite."""
        contact, stiffness = state.contact, state.tangent.stiffness
        assert stiffness is not None
        blocks = [t.blocks for t in contact.tractions]
        while True:
            matrix = with_contact(self._damping.lend(stiffness), contact.points, blocks, threads=self.body.threads)
            matrix = unconstrained.steadied(matrix, state.turn)
            right = state.residual - matrix.product(state.jump, threads=self.body.threads)
            if contact.nonsymmetric is not None:
                right -= state.free * (contact.nonsymmetric @ state.jump)
            try:
                done = self._solver.solve(matrix, state.free, right, contact.nonsymmetric)
            except IndefiniteError:
                done = Iteration(np.zeros_like(right), SolveStatus.INDEFINITE, 0, 1.0, np.empty(0))
            self.solves += 1
            self.iterations += done.iterations
            if done.status is not SolveStatus.INDEFINITE or not self._damping.more():
                return done

    def _advance(self, state: NewtonState, move: Array, unconstrained: UnconstrainedBodies) -> float:
        """Go along a Newton step (3N,) as far as it serves: the share of it that was gone."""
        stride = self._stride(state, move, unconstrained)
        move *= stride
        length = self._length(state, move, unconstrained)
        if length > 0.0:
            if state.arrived:
                self._damping.judge(stride * length)
            state.advance(move, length)
        return length

    def _stride(self, state: NewtonState, move: Array, unconstrained: UnconstrainedBodies) -> float:
        """Share of a move (3N,) that points can see ahead; all of it on the way to what is prescribed."""
        if not state.arrived:
            return 1.0
        reach = self._system.reach
        stride = unconstrained.within(move, reach)
        if any(t.active.any() for t in state.contact.tractions):
            stride = min(stride, _STRIDE * reach / max(float(np.abs(move).max()), 1e-300))
        return stride

    def _length(self, state: NewtonState, move: Array, unconstrained: UnconstrainedBodies) -> float:
        """How far to go along a move (3N,), 1 for all of it; 0 where elements turn inside out however short it is."""
        length = length_upright(self._elastic, state.u, move, state.tangent.lowest)
        if length == 0.0:
            return 0.0
        settling = state.arrived and state.alternating
        watched = state.free if settling else state.free & np.repeat(unconstrained.falling(state.contact), 3)
        length = length_by_work(state, move, length, watched)
        if settling and state.contact.nonsymmetric is not None:
            length = length_by_residual(state, move, length)
        return length

    def _unconstrained(self, prescribed: Prescribed) -> UnconstrainedBodies:
        key = prescribed.degrees.tobytes()
        if self._free is None or self._free[0] != key:
            self._free = (key, UnconstrainedBodies(self.body, prescribed, self._elastic.stiffness))
        return self._free[1]
