"""One load step of bodies in contact: Newton's method on bodies and contact together.

The system is K plus a moderate penalty at the contact points, symmetric and well conditioned, so that conjugate
gradients keep working; the multipliers are brought up to date after every linear solve, so that what the penalty
leaves of overlap and slip is gone when forces balance (Simo & Laursen 1992; reference: B §3.4, R108, R117).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.body import Body, Tangent
from warpjld.fem.conjugate import Status
from warpjld.fem.contact.interplay import Contact, Interplay, alike, shifted
from warpjld.fem.contact.law import Memory, Response
from warpjld.fem.contact.loose import Loose
from warpjld.fem.contact.points import ContactPoints, Interface
from warpjld.fem.contact.step_solver import StepSolver
from warpjld.fem.contact.stiffness import with_contact
from warpjld.fem.dots import dot, norm
from warpjld.fem.loads import Loads, external_forces, subtract_pressure_stiffness
from warpjld.fem.multigrid import IndefiniteError
from warpjld.fem.prescribed import Prescribed

__all__ = ["Equilibrium", "Reached", "Step"]

_ITERATIONS = 40
_PENALTY = 60.0
"""Contact stiffness over E* by the edge of a face: more makes the linear solves slow, less makes them many."""
_ROUNDING = 1e-13
"""Part of stiffness times displacement that is rounding, where bodies move without a force."""
_PLACES = 0.03
"""The same of positions, over that of displacements: gaps are differences of positions."""
_TURNING = 1
"""Iterations after which normals stay; weights follow until they no longer change the gaps. That both are right is
looked at once forces balance. (Newton's method without their derivatives converges slowly, with them not symmetric.)"""
_CARELESS = 8
"""Iterations with full steps and multipliers brought up to date at once; what has not settled by then takes turns."""
_LINE_SEARCH = 8


@dataclass(frozen=True, eq=False)
class Step:
    """What a load step goes from and to.

    Attributes:
        before: Time it starts from.
        time: Time it goes to.
        prescribed: Displacements at ``time``.
        loads: Loads, and the share of them that acts at ``time``.
        share: That share.
        allowed: Share of the overlap at the start that is still allowed at ``time``.
    """

    before: float
    time: float
    prescribed: Prescribed
    loads: Loads
    share: float
    allowed: float


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
        self._tangent: Tangent | None = None
        self._rest = None if body.large_strain else body.at()
        self._loose: tuple[bytes, Loose] | None = None
        tangent = self._rest or body.at()
        assert tangent.stiffness is not None
        blocks = tangent.stiffness.diagonal()
        self._stiff = np.einsum("nii->n", blocks) / 3.0
        self._solver = StepSolver(body, self._stiff, precision)
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
        play = self._interplay
        self._solver.begin()
        memory = play.begun(memory, start, step.before)
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
            pressures = body.at(start, stiffness=False).pressures if body.large_strain else None
        normals = play.normals(u)
        held = (play.points(u, step.before, step.time, normals), u)
        settled, since, falls = False, 0, 0
        contact = play.answered(held[0], u, start, memory, keep=True, allowed=step.allowed)
        for iteration in range(_ITERATIONS):
            careful = iteration - since >= _CARELESS
            tangent = self._at(u, pressures)
            external = step.share * external_forces(body, step.loads, u if body.large_strain else None)
            residual = np.where(free, external + contact.forces - tangent.forces, 0.0)
            balance = tangent.forces - external - contact.forces
            moved = not jump.any()
            pushed = norm(np.where(free, contact.forces, 0.0))
            scale = max(norm(external), pushed, norm(np.where(free, 0.0, balance)), 1e-300)
            now = norm(residual) / scale
            noise = _ROUNDING * (norm(np.repeat(self._stiff, 3) * u) + _PLACES * norm(self._stiff) * body.mesh.size)
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
            stiffness = tangent.stiffness
            assert stiffness is not None
            if body.large_strain:
                subtract_pressure_stiffness(stiffness, body, step.loads, u, step.share)
            matrix = with_contact(
                stiffness, contact.points, [r.blocks for r in contact.responses], threads=body.threads
            )
            matrix = loose.steadied(matrix, iteration - since)
            try:
                done = self._solver.solve(matrix, free, residual - matrix.product(jump, threads=body.threads))
            except IndefiniteError:
                return Status.INDEFINITE, None
            self.solves += 1
            self.iterations += done.iterations
            if done.status in (Status.INDEFINITE, Status.NOT_FINITE):
                return done.status, None
            move = done.x + jump
            if not jump.any():
                move *= loose.leash(move, play.reach)
            watched = free if moved and careful else free & np.repeat(loose.falling(contact), 3)
            length = self._search(u, move, contact, memory, step, residual, watched, patient=careful)
            if length == 0.0:
                return Status.INVERTED, None
            move *= length
            if body.large_strain:
                pressures = body.at(u, stiffness=False, increment=move).pressures
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
                normals = play.normals(u) if iteration < _TURNING else normals
                fresh = play.points(u, step.before, step.time, normals)
                settled = iteration > _TURNING and play.mismatch(fresh, points, foreseen) <= 0.5 * self._penetration
                held, points = (held, points) if settled else ((fresh, u), fresh)
            careful = iteration + 1 - since >= _CARELESS
            contact = play.answered(points, u, start, memory, keep=not careful, allowed=step.allowed)
            falls = falls + 1 if loose.falling(contact).any() else 0
            if falls > _CARELESS:
                break
        status, self.trouble = loose.trouble(self.interfaces, contact)
        return status, None

    def _guessed(self, first: NDArray[np.float64] | None, prescribed: Prescribed) -> NDArray[np.float64] | None:
        """A first guess that satisfies what is prescribed, unless it turns an element inside out."""
        if first is None:
            return None
        u = np.array(first, dtype=np.float64).reshape(-1)
        u[prescribed.degrees] = prescribed.values
        if self._rest is not None:
            return u
        return u if (self.body.at(u, stiffness=False).lowest > 0).all() else None

    def _search(
        self,
        u: NDArray[np.float64],
        move: NDArray[np.float64],
        contact: Contact,
        memory: list[Memory],
        step: Step,
        residual: NDArray[np.float64],
        watched: NDArray[np.bool_],
        *,
        patient: bool,
    ) -> float:
        """How far to go, zero for nowhere: no element inside out; and, where forces on the watched degrees of freedom
        (3N,) pull back there harder than half of what drives here, to where they balance along the way. A contact that
        opens and closes in turn settles so, and what falls freely stops where it first touches.
        """
        body = self.body
        length = 1.0
        if self._rest is not None and not watched.any():
            return length
        for _ in range(_LINE_SEARCH):
            there = u + length * move
            trial = self._forces(there)
            if self._rest is not None or (trial.lowest > 0).all():
                break
            length *= 0.5
        else:
            return 0.0
        if not watched.any():
            return length
        along = np.where(watched, move, 0.0)

        def pull(part: float) -> float:
            """What drives on after part of the way; contact as the linear model has it."""
            here = u + part * move
            bodies = trial if part == length else self._forces(here)
            external = step.share * external_forces(body, step.loads, here if body.large_strain else None)
            foreseen = self._interplay.foreseen(contact, memory, part * move, step.allowed, patient=patient)
            return dot(external - bodies.forces + self._interplay.pushed(contact.points, foreseen), along)

        start, end = dot(residual, along), pull(length)
        if not (start > 0.0 and end < -0.5 * start):
            return length
        return max(_balance(pull, length, start, end), 1e-6)

    def _forces(self, u: NDArray[np.float64]) -> Tangent:
        return self._at(u, None) if self._rest is not None else self.body.at(u, stiffness=False)

    def _at(self, u: NDArray[np.float64], pressures: NDArray[np.float64] | None) -> Tangent:
        if self._rest is None:
            self._tangent = self.body.at(u, pressures=pressures, reuse=self._tangent)
            return self._tangent
        assert self._rest.stiffness is not None
        return replace(
            self._rest, forces=self._rest.forces + self._rest.stiffness.product(u, threads=self.body.threads)
        )

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
            self._loose = (key, Loose(self.body, prescribed, self._stiff))
        return self._loose[1]


def _balance(pull: Callable[[float], float], end: float, at_start: float, at_end: float) -> float:
    """Part of the way up to ``end`` at which what drives on changes its sign, about (Illinois' regula falsi)."""
    low, high, driving, against = 0.0, end, at_start, at_end
    for _ in range(_LINE_SEARCH):
        part = float(
            np.clip(
                (low * against - high * driving) / (against - driving),
                low + 0.02 * (high - low),
                high - 0.02 * (high - low),
            )
        )
        there = pull(part)
        if abs(there) <= 0.3 * at_start:
            return part
        if there > 0.0:
            against *= 0.5 if low > 0.0 else 1.0
            low, driving = part, there
        else:
            driving *= 0.5 if high < end else 1.0
            high, against = part, there
    return low or high
