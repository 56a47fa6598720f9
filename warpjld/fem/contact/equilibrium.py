"""One load step of bodies in contact: Newton's method on bodies and contact together.

The system is K plus a moderate penalty at the contact points, symmetric and well conditioned, so that conjugate
gradients keep working (between bodies that both deform it preconditions what is not symmetric of Newton's matrix, see
``slopes``); the multipliers are brought up to date after every linear solve, so that what the penalty
leaves of overlap and slip is gone when forces balance (Simo & Laursen 1992; reference: B §3.4, R108, R117).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.blockmatrix import BlockMatrix
from warpjld.fem.body import Body
from warpjld.fem.conjugate import Iteration, Status
from warpjld.fem.contact.damping import Damping
from warpjld.fem.contact.elastic import Elastic
from warpjld.fem.contact.interplay import Contact, Interplay, alike, shifted
from warpjld.fem.contact.law import Memory, Response
from warpjld.fem.contact.line_search import LineSearch
from warpjld.fem.contact.loose import Loose
from warpjld.fem.contact.points import ContactPoints, Interface
from warpjld.fem.contact.step import Step
from warpjld.fem.contact.step_solver import StepSolver
from warpjld.fem.contact.stiffness import with_contact
from warpjld.fem.dots import norm
from warpjld.fem.indefinite import IndefiniteError
from warpjld.fem.prescribed import Prescribed

__all__ = ["Equilibrium", "Reached"]

_ITERATIONS = 40
_PENALTY = 200.0
"""Contact stiffness over E* by the edge of a face: more makes the linear solves slow, less makes them many."""
_ROUNDING = 1e-13
"""Part of stiffness times displacement that is rounding, where bodies move without a force."""
_PLACES = 0.03
"""The same of positions, over that of displacements: gaps are differences of positions."""
_TURNING = 1
"""Iterations after which normals stay where their derivatives are not known; weights follow until they no longer change
the gaps. That both are right is looked at once forces balance."""
_CARELESS = 8
"""Iterations with full steps and multipliers brought up to date at once; what has not settled by then takes turns."""
_SURE = 1
"""Iterations after which multipliers are good enough to take the derivatives of directions with; until then those of
the equilibrium before are."""
_STRIDE = 0.25
"""Farthest a node moves in an iteration where something presses, over what points look ahead (two edges)."""


@dataclass(frozen=True, eq=False)
class Reached:
    """Equilibrium at the end of a load step."""

    displacement: NDArray[np.float64]
    reactions: NDArray[np.float64]
    points: list[ContactPoints]
    responses: list[Response]
    slips: list[NDArray[np.float64]]
    memory: list[Memory]
    residual: float


class Equilibrium:
    """The bodies and interfaces of a contact problem, and the matrices kept between steps.

    Args:
        body: All bodies, merged.
        interfaces: What may touch.
        moduli: E* at each interface's slave nodes [Pa].
        tolerance: Relative residual.
        penetration: Overlap left, as a share of an edge.
        precision: Of the linear solver.
    """

    def __init__(
        self,
        body: Body,
        interfaces: list[Interface],
        moduli: list[NDArray[np.float64]],
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
        self._solver = StepSolver(body, precision)
        self._damping = Damping(body)
        self._interplay = Interplay(body.mesh.nodes, interfaces, moduli, penalty=penalty, penetration=penetration)

    def find(
        self,
        u: NDArray[np.float64],
        memory: list[Memory],
        step: Step,
        first: NDArray[np.float64] | None = None,
    ) -> tuple[Status, Reached | None]:
        """Equilibrium from displacement u (3N,) at ``step.before``; ``first`` is where to begin to look."""
        body, start = self.body, u
        known = step.prescribed.degrees
        free = step.prescribed.free(body.degrees)
        loose = self._unheld(step.prescribed)
        play, elastic = self._interplay, self._elastic
        search = LineSearch(elastic, play, step, start)
        self._solver.begin()
        self._damping.begin()
        memory = before = play.begun(memory, start, step.before)
        pressures: NDArray[np.float64] | None = None
        jump = np.zeros_like(u)
        guessed = self._guessed(first, step.prescribed)
        if guessed is None:
            u = start.copy()
            jump[known] = step.prescribed.values - u[known]
        else:
            u = guessed
            # a guess squeezes elements here and there: their false pressures would make K indefinite, those of the
            # equilibrium before do not
            pressures = elastic.pressures(start)
        normals = play.normals(u)
        held = (play.points(u, step.before, step.time, normals), u)
        settled, since, falls = False, 0, 0
        contact = play.answered(held[0], u, start, memory, keep=True, allowed=step.allowed)
        for iteration in range(_ITERATIONS):
            careful = iteration - since >= _CARELESS
            tangent = elastic.at(u, pressures, step.loads)
            external = elastic.external(step.loads, u)
            residual = np.where(free, external + contact.forces - tangent.forces, 0.0)
            balance = tangent.forces - external - contact.forces
            moved = not jump.any()
            pushed = norm(np.where(free, contact.forces, 0.0))
            scale = max(norm(external), pushed, norm(np.where(free, 0.0, balance)), 1e-300)
            now = norm(residual) / scale
            noise = _ROUNDING * (
                norm(np.repeat(self._elastic.stiffness, 3) * u)
                + _PLACES * norm(self._elastic.stiffness) * body.mesh.size
            )
            negligible = max(self._tolerance * scale, noise)
            settled_down = pushed <= noise or play.settled(contact, memory, negligible)
            if moved and now <= max(self._tolerance, noise / scale) and settled_down:
                normals = play.normals(u)
                fresh = play.points(u, step.before, step.time, normals)
                if step.allowed > 0.0 or play.mismatch(fresh, contact.points, contact.responses) <= self._penetration:
                    return Status.CONVERGED, self._reached(u, np.where(free, 0.0, balance), contact, memory, now)
                held, settled, since = (fresh, u), False, iteration
                contact = play.answered(fresh, u, start, memory, keep=True, allowed=step.allowed)
                continue
            if not np.isfinite(now):
                return Status.NOT_FINITE, None
            contact = play.sloped(contact, memory, memory if iteration >= _SURE else before, u)
            stiffness = tangent.stiffness
            assert stiffness is not None
            steadied = partial(loose.steadied, turn=iteration - since)
            done = self._solved(stiffness, contact, free, residual, jump, steadied)
            if done.status in (Status.INDEFINITE, Status.NOT_FINITE):
                return done.status, None
            move = done.x + jump
            stride = 1.0
            if not jump.any():
                far = max(float(np.abs(move).max()), 1e-300)
                stride = min(1.0, loose.leash(move, play.reach))
                if any(r.active.any() for r in contact.responses):
                    stride = min(stride, _STRIDE * play.reach / far)
                move *= stride
            watched = free if moved and careful else free & np.repeat(loose.falling(contact), 3)
            length = search.upright(u, move)
            if length > 0.0:
                length = search.by_work(u, move, length, contact, memory, residual, watched, patient=careful)
                if careful and contact.beside is not None and not jump.any():
                    length = search.by_balance(u, move, length, memory, residual, free)
            else:
                if not self._damping.more():
                    return Status.INVERTED, None
                continue
            if moved:
                self._damping.judge(stride * length)
            move *= length
            pressures = elastic.pressures(u, move)
            u = u + move
            jump *= 1.0 - length
            if length == 1.0:
                u[known] = step.prescribed.values
                jump[:] = 0.0
            foreseen = play.foreseen(contact, memory, move, step.allowed, patient=careful)
            if not careful or alike(contact.responses, foreseen):
                memory = play.remembered(memory, contact, foreseen, move, patient=careful)
            points = [shifted(p, (u - held[1]).reshape(-1, 3)) for p in held[0]]
            if not settled:
                normals = play.turned(normals, u, iteration < _TURNING)
                fresh = play.points(u, step.before, step.time, normals)
                settled = iteration > _TURNING and play.mismatch(fresh, points, foreseen) <= 0.5 * self._penetration
                held, points = (held, points) if settled else ((fresh, u), fresh)
            if settled:
                points = play.refreshed(points, u, step.before, step.time)
            careful = iteration + 1 - since >= _CARELESS
            contact = play.answered(points, u, start, memory, keep=not careful, allowed=step.allowed)
            falls = falls + 1 if loose.falling(contact).any() else 0
            if falls > _CARELESS:
                break
        status, self.trouble = loose.trouble(self.interfaces, contact)
        if status is Status.MAX_ITERATIONS and self._damping.share > 0.0:
            status = Status.INDEFINITE
        return status, None

    def _solved(
        self,
        stiffness: BlockMatrix,
        contact: Contact,
        free: NDArray[np.bool_],
        residual: NDArray[np.float64],
        jump: NDArray[np.float64],
        steadied: Callable[[BlockMatrix], BlockMatrix],
    ) -> Iteration:
        """A Newton step's free displacements; damped as far as the matrix needs it to be positive definite."""
        blocks = [r.blocks for r in contact.responses]
        while True:
            matrix = with_contact(self._damping.lend(stiffness), contact.points, blocks, threads=self.body.threads)
            matrix = steadied(matrix)
            right = residual - matrix.product(jump, threads=self.body.threads)
            if contact.beside is not None:
                right -= free * (contact.beside @ jump)
            try:
                done = self._solver.solve(matrix, free, right, contact.beside)
            except IndefiniteError:
                done = Iteration(np.zeros_like(residual), Status.INDEFINITE, 0, 1.0, np.empty(0))
            self.solves += 1
            self.iterations += done.iterations
            if done.status is not Status.INDEFINITE or not self._damping.more():
                return done

    def _guessed(self, first: NDArray[np.float64] | None, prescribed: Prescribed) -> NDArray[np.float64] | None:
        """A first guess that satisfies what is prescribed, unless it turns an element inside out."""
        if first is None:
            return None
        u = np.array(first, dtype=np.float64).reshape(-1)
        u[prescribed.degrees] = prescribed.values
        return u if self._elastic.upright(u) else None

    def _reached(
        self,
        u: NDArray[np.float64],
        reactions: NDArray[np.float64],
        contact: Contact,
        memory: list[Memory],
        residual: float,
    ) -> Reached:
        kept = self._interplay.remembered(memory, contact, contact.responses, np.zeros_like(u), patient=True)
        kept = [replace(m, anchor=np.zeros_like(m.anchor)) for m in kept]
        return Reached(u, reactions, contact.points, contact.responses, contact.slips, kept, residual)

    def _unheld(self, prescribed: Prescribed) -> Loose:
        key = prescribed.degrees.tobytes()
        if self._loose is None or self._loose[0] != key:
            self._loose = (key, Loose(self.body, prescribed, self._elastic.stiffness))
        return self._loose[1]
