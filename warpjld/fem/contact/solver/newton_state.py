"""Where a search for equilibrium stands, and how it goes on: Newton's steps in turn with what points remember."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.body import Tangent
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.law import ContactState, Response
from warpjld.fem.contact.solver.contact_system import Contact, Interplay, alike, shifted
from warpjld.fem.contact.solver.elastic import Elastic
from warpjld.fem.contact.solver.load_step import Step
from warpjld.fem.solver.block_matrix import norm

__all__ = ["Reached", "Walk"]

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


@dataclass(frozen=True, eq=False)
class Reached:
    """Equilibrium at the end of a load step."""

    displacement: Array
    reactions: Array
    points: list[ContactPoints]
    responses: list[Response]
    slips: list[Array]
    memory: list[ContactState]
    residual: float


class Walk:
    """A search for the equilibrium at the end of a load step.

    Args:
        elastic: The bodies.
        play: Their contact.
        step: The load step.
        start: Displacement at its start [m], shape (3N,).
        memory: What points remember there.
        guesses: Where to begin to look, best first [m], shape (3N,): the first that turns no element inside out is.
        tolerance: Residual over the forces that balance.
        penetration: Overlap left, as a share of an edge.

    Attributes:
        u: Displacement [m], shape (3N,).
        jump: What prescribed degrees of freedom have yet to go [m], shape (3N,).
        free: Which are not prescribed, shape (3N,).
        memory: What points remember.
        contact: What they answer at ``u``.
        tangent: The bodies' forces and stiffness at ``u``.
        residual: Forces left over at what is free [N], shape (3N,).
        unbalanced: Their size over that of the forces that balance.
    """

    contact: Contact
    tangent: Tangent
    residual: Array
    unbalanced: float

    def __init__(
        self,
        elastic: Elastic,
        play: Interplay,
        step: Step,
        start: Array,
        memory: list[ContactState],
        guesses: Sequence[Array],
        *,
        tolerance: float,
        penetration: float,
    ) -> None:
        self._elastic, self._play, self._step, self._start = elastic, play, step, start
        self._tolerance, self._penetration = tolerance, penetration
        self.free = step.prescribed.free(len(start))
        self.memory = self._before = play.begun(memory, start, step.before)
        self.jump = np.zeros_like(start)
        self._pressures: Array | None = None
        self._iteration, self._since, self._settled = -1, 0, False
        guess = next((held for held in map(self._held, guesses) if elastic.upright(held)), None)
        if guess is not None:
            self.u = guess
            # a guess squeezes elements here and there: their false pressures would make K indefinite, those of the
            # equilibrium before do not
            self._pressures = elastic.pressures(start)
        else:
            self.u = start.copy()
            self.jump = self._held(start) - start
        self._normals = play.normals(self.u)
        self._seen = (play.points(self.u, step.before, step.time, self._normals), self.u)
        self._answer(self._seen[0], keep=True)

    @property
    def turn(self) -> int:
        """Iterations since the search began, or began anew."""
        return self._iteration - self._since

    @property
    def careful(self) -> bool:
        """Whether it has gone on for so long that steps and multipliers take turns."""
        return self.turn >= _CARELESS

    @property
    def arrived(self) -> bool:
        """Whether what is prescribed is where it is to be."""
        return not self.jump.any()

    def weigh(self) -> None:
        """Find the forces, and what of them is left over."""
        self._iteration += 1
        elastic, u, free, contact = self._elastic, self.u, self.free, self.contact
        self.tangent = elastic.at(u, self._pressures, self._step.loads)
        external = elastic.external(self._step.loads, u)
        self.residual = np.where(free, external + contact.forces - self.tangent.forces, 0.0)
        self._reactions = np.where(free, 0.0, self.tangent.forces - external - contact.forces)
        pushed = norm(np.where(free, contact.forces, 0.0))
        scale = max(norm(external), pushed, norm(self._reactions), 1e-300)
        self.unbalanced = norm(self.residual) / scale
        moved = norm(np.repeat(elastic.stiffness, 3) * u)
        noise = _ROUNDING * (moved + _PLACES * norm(elastic.stiffness) * elastic.body.mesh.size)
        self._negligible = max(self._tolerance * scale, noise)
        self._near = self.unbalanced <= max(self._tolerance, noise / scale)
        self._quiet = pushed <= noise

    def balanced(self) -> bool:
        """Whether forces balance as the points see them."""
        if not (self.arrived and self._near):
            return False
        return self._quiet or self._play.settled(self.contact, self.memory, self._negligible)

    def confirmed(self) -> bool:
        """Whether the points see what is so; where not, the search begins anew with points that do."""
        play, step = self._play, self._step
        self._normals = play.normals(self.u)
        fresh = play.points(self.u, step.before, step.time, self._normals)
        contact = self.contact
        if step.allowed > 0.0 or play.mismatch(fresh, contact.points, contact.responses) <= self._penetration:
            return True
        self._seen, self._settled, self._since = (fresh, self.u), False, self._iteration
        self._answer(fresh, keep=True)
        return False

    def reached(self) -> Reached:
        """The equilibrium."""
        contact = self.contact
        nothing = np.zeros_like(self.u)
        kept = self._play.remembered(self.memory, contact, contact.responses, nothing, patient=True)
        left = 1.0 if self._step.allowed > 0.0 else 0.0  # what was parted stays so
        kept = [replace(m, anchor=np.zeros_like(m.anchor), allowance=left * m.allowance) for m in kept]
        # on the way to where friction took hold of it, what was apart slid on nothing
        slips = [s - m.anchor[p.sites] for s, m, p in zip(contact.slips, self.memory, contact.points, strict=True)]
        return Reached(self.u, self._reactions, contact.points, contact.responses, slips, kept, self.unbalanced)

    def slope(self) -> None:
        """Find what a symmetric stiffness leaves out."""
        pressed = self.memory if self._iteration >= _SURE else self._before
        self.contact = self._play.sloped(self.contact, self.memory, pressed, self.u)

    def go(self, move: Array, length: float) -> None:
        """Go a part of the way along a move (3N,), and bring up to date what points remember, and what they see."""
        play, careful = self._play, self.careful
        move = length * move
        self._pressures = self._elastic.pressures(self.u, move)
        self.u = self.u + move
        self.jump = self.jump * (1.0 - length)
        if length == 1.0:
            self.u = self._held(self.u)
            self.jump = np.zeros_like(self.u)
        foreseen = play.foreseen(self.contact, self.memory, move, self._step.allowed, patient=careful)
        same = alike(self.contact.responses, foreseen)
        if not careful or same:
            self.memory = play.remembered(self.memory, self.contact, foreseen, move, patient=careful)
        points, keep = self._points(foreseen), self.turn + 1 < _CARELESS
        coupled = not keep and same and not any((r.active & r.sticking).any() for r in foreseen)
        self._answer(points, keep=keep, coupled=coupled)

    def _points(self, foreseen: list[Response]) -> list[ContactPoints]:
        """Points after a move: seen afresh until that no longer changes the gaps."""
        play, step = self._play, self._step
        points = [shifted(p, (self.u - self._seen[1]).reshape(-1, 3)) for p in self._seen[0]]
        if not self._settled:
            self._normals = play.turned(self._normals, self.u, self._iteration < _TURNING)
            fresh = play.points(self.u, step.before, step.time, self._normals)
            if self._iteration > _TURNING:
                self._settled = play.mismatch(fresh, points, foreseen) <= 0.5 * self._penetration
            if not self._settled:
                self._seen, points = (fresh, self.u), fresh
        return play.refreshed(points, self.u, step.before, step.time) if self._settled else points

    def _answer(self, points: list[ContactPoints], *, keep: bool, coupled: bool = False) -> None:
        self.contact = self._play.answered(
            points, self.u, self._start, self.memory, keep=keep, allowed=self._step.allowed, coupled=coupled
        )

    def _held(self, u: Array) -> Array:
        """With the prescribed values where there are such."""
        prescribed = self._step.prescribed
        out = np.array(u, dtype=np.float64).reshape(-1)
        out[prescribed.degrees] = prescribed.values
        return out
