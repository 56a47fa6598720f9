"""One load step of bodies in contact: Newton's method on bodies and contact together.

The system is K plus a moderate penalty at the contact points, symmetric and well conditioned, so that conjugate
gradients keep working (between bodies that both deform it preconditions what is not symmetric of Newton's matrix, see
``slopes``); the multipliers are brought up to date after every linear solve, so that what the penalty
leaves of overlap and slip is gone when forces balance (Simo & Laursen 1992; reference: B §3.4, R108, R117).
"""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_points import Interface
from warpjld.fem.contact.law.law import ContactState
from warpjld.fem.contact.solver.contact_system import Interplay
from warpjld.fem.contact.solver.damping import Damping
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.lagged_solver import LaggedSolver
from warpjld.fem.contact.solver.line_search import LineSearch
from warpjld.fem.contact.solver.load_step import Step
from warpjld.fem.contact.solver.newton_state import Reached, Walk
from warpjld.fem.contact.solver.stiffness import with_contact
from warpjld.fem.contact.solver.unconstrained import Loose
from warpjld.fem.load.prescribed import Prescribed
from warpjld.fem.solver.block_matrix import IndefiniteError
from warpjld.fem.solver.conjugate import Iteration, Status

__all__ = ["Equilibrium"]

_ITERATIONS = 40
_PENALTY = 200.0
"""Contact stiffness over E* by the edge of a face: more makes the linear solves slow, less makes them many."""
_STRIDE = 0.25
"""Farthest a node moves in an iteration where something presses, over what points look ahead (two edges)."""
_FALLS = 8
"""Iterations in a row that a loose body may fall for, with nothing touching it."""


class Equilibrium:
    """The bodies and interfaces of a contact problem, and the matrices kept between steps.

    Args:
        body: All bodies, merged.
        interfaces: What may touch.
        moduli: E* at each interface's slave nodes [Pa].
        tolerance: Relative residual.
        penetration: Overlap left, as a share of an edge.
        precision: Of the linear solver.

    Attributes:
        solves: Linear solves so far.
        iterations: Their iterations.
        trouble: Why no equilibrium was found, where that is known.
    """

    def __init__(
        self,
        body: Body,
        interfaces: list[Interface],
        moduli: list[Array],
        *,
        tolerance: float = 1e-5,
        penetration: float = 1e-3,
        penalty: float = _PENALTY,
        precision: str = "float64",
    ) -> None:
        self.body = body
        self.interfaces = interfaces
        self.solves = 0
        self.iterations = 0
        self.trouble = ""
        self._tolerance = tolerance
        self._penetration = penetration
        self._loose: tuple[bytes, Loose] | None = None
        self._elastic = Elastic(body)
        self._solver = LaggedSolver(body, precision)
        self._damping = Damping(body)
        self._interplay = Interplay(body.mesh.nodes, interfaces, moduli, penalty=penalty, penetration=penetration)

    def find(self, u: Array, memory: list[ContactState], step: Step, *guesses: Array) -> tuple[Status, Reached | None]:
        """Equilibrium from displacement u (3N,) at ``step.before``.

        It is looked for from the first of the guesses that turns no element inside out, or from u.
        """
        loose = self._unheld(step.prescribed)
        self._solver.begin()
        self._damping.begin()
        search = LineSearch(self._elastic, self._interplay, step, u)
        walk = Walk(
            self._elastic,
            self._interplay,
            step,
            u,
            memory,
            guesses,
            tolerance=self._tolerance,
            penetration=self._penetration,
        )
        falls = 0
        for _ in range(_ITERATIONS):
            walk.weigh()
            if walk.balanced():
                if walk.confirmed():
                    return Status.CONVERGED, walk.reached()
                continue
            if not np.isfinite(walk.unbalanced):
                return Status.NOT_FINITE, None
            walk.slope()
            done = self._solved(walk, loose)
            if done.status in (Status.INDEFINITE, Status.NOT_FINITE):
                return done.status, None
            move = done.x + walk.jump
            stride = self._stride(walk, move, loose)
            move *= stride
            length = _length(search, walk, move, loose)
            if length == 0.0:
                if not self._damping.more():
                    return Status.INVERTED, None
                continue
            if walk.arrived:
                self._damping.judge(stride * length)
            walk.go(move, length)
            falls = falls + 1 if loose.falling(walk.contact).any() else 0
            if falls > _FALLS:
                break
        status, self.trouble = loose.trouble(self.interfaces, walk.contact)
        if status is Status.MAX_ITERATIONS and self._damping.share > 0.0:
            status = Status.INDEFINITE
        return status, None

    def _solved(self, walk: Walk, loose: Loose) -> Iteration:
        """A Newton step's free displacements; damped as far as the matrix needs it to be positive definite."""
        contact, stiffness = walk.contact, walk.tangent.stiffness
        assert stiffness is not None
        blocks = [r.blocks for r in contact.responses]
        while True:
            matrix = with_contact(self._damping.lend(stiffness), contact.points, blocks, threads=self.body.threads)
            matrix = loose.steadied(matrix, walk.turn)
            right = walk.residual - matrix.product(walk.jump, threads=self.body.threads)
            if contact.beside is not None:
                right -= walk.free * (contact.beside @ walk.jump)
            try:
                done = self._solver.solve(matrix, walk.free, right, contact.beside)
            except IndefiniteError:
                done = Iteration(np.zeros_like(right), Status.INDEFINITE, 0, 1.0, np.empty(0))
            self.solves += 1
            self.iterations += done.iterations
            if done.status is not Status.INDEFINITE or not self._damping.more():
                return done

    def _stride(self, walk: Walk, move: Array, loose: Loose) -> float:
        """Share of a move (3N,) that points can see ahead; all of it on the way to what is prescribed."""
        if not walk.arrived:
            return 1.0
        reach = self._interplay.reach
        stride = loose.leash(move, reach)
        if any(r.active.any() for r in walk.contact.responses):
            stride = min(stride, _STRIDE * reach / max(float(np.abs(move).max()), 1e-300))
        return stride

    def _unheld(self, prescribed: Prescribed) -> Loose:
        key = prescribed.degrees.tobytes()
        if self._loose is None or self._loose[0] != key:
            self._loose = (key, Loose(self.body, prescribed, self._elastic.stiffness))
        return self._loose[1]


def _length(search: LineSearch, walk: Walk, move: Array, loose: Loose) -> float:
    """How far to go along a move (3N,), 1 for all of it; 0 where elements turn inside out however short it is."""
    length = search.upright(walk.u, move, walk.tangent.lowest)
    if length == 0.0:
        return 0.0
    contact, memory, careful = walk.contact, walk.memory, walk.careful
    watched = walk.free if walk.arrived and careful else walk.free & np.repeat(loose.falling(contact), 3)
    length = search.by_work(walk.u, move, length, contact, memory, walk.residual, watched, patient=careful)
    if careful and contact.beside is not None and walk.arrived:
        length = search.by_balance(walk.u, move, length, memory, walk.residual, walk.free, coupled=contact.coupled)
    return length
