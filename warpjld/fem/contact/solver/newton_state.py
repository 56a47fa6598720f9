"""State of Newton's method in a load step: displacement, contact states and residual, and how they go on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from warpjld.fem.arrays import Array, norm
from warpjld.fem.body import Tangent
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.fem.contact.law.return_mapping import ContactTractions
from warpjld.fem.contact.solver.contact_system import (
    ContactForces,
    ContactSystem,
    LoadStep,
    same_active_set,
    shifted,
)
from warpjld.fem.contact.solver.elastic import Elastic

__all__ = ["Equilibrium", "NewtonState", "guess_held"]

_ROUNDING = 1e-13
"""Part of stiffness times displacement that is rounding, where bodies move without a force."""
_PLACES = 0.03
"""The same of positions, over that of displacements: gaps are differences of positions."""
_TURNING = 1
"""Iterations after which normals stay where their derivatives are not known; weights follow until they no longer change
the gaps. That both are right is looked at once forces balance."""
_STALE = 0.025
"""Way of a node since points were seen, over what they look ahead, from which on they are seen afresh again: along a
curved surface gaps change with the way's square."""
_FIXED_POINT = 8
"""Iterations with full steps and multipliers brought up to date at once; what has not settled by then takes turns."""
_SAME = 2
"""Iterations in a row in which the same points touch, slide and stick, after which friction follows the present
pressure: taking what points press and what they rub in turns creeps."""
_SHORT, _STUMBLES = 0.1, 2
"""Shortest step of friction that follows the present pressure beside points that stick, and how often one may be
shorter: points on the edge of sticking then come and go, and taking pressure and friction in turns is safer."""
_MULTIPLIERS_GOOD = 1
"""Iterations after which multipliers are good enough to take the derivatives of directions with; until then those of
the equilibrium before are."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equilibrium at the end of a load step."""

    displacement: Array
    reactions: Array
    points: list[ContactPoints]
    tractions: list[ContactTractions]
    slips: list[Array]
    states: list[ContactState]
    residual: float


class NewtonState:
    """A search for the equilibrium at the end of a load step.

    Args:
        elastic: The bodies.
        system: Their contact.
        step: The load step.
        start: Displacement at its start [m], shape (3N,).
        states: What is known of contact points there.
        guess: Where to begin to look [m], shape (3N,), no element inside out; None: at ``start``, what is prescribed
            yet to go to its place.
        tolerance: Residual over the forces that balance.
        penetration: Overlap left, as a share of an edge.

    Attributes:
        u: Displacement [m], shape (3N,).
        jump: What prescribed degrees of freedom have yet to go [m], shape (3N,).
        free: Which are not prescribed, shape (3N,).
        states: Multipliers and active sets.
        contact: Contact forces at ``u``.
        tangent: The bodies' forces and stiffness at ``u``.
        residual: Forces left over at what is free [N], shape (3N,).
        unbalanced: Their size over that of the forces that balance.
        restarts: How often forces balanced and points, found afresh, did not agree.
    """

    contact: ContactForces
    tangent: Tangent
    residual: Array
    unbalanced: float

    def __init__(
        self,
        elastic: Elastic,
        system: ContactSystem,
        step: LoadStep,
        start: Array,
        states: list[ContactState],
        guess: Array | None,
        *,
        tolerance: float,
        penetration: float,
    ) -> None:
        self.elastic, self.system, self.step, self.start = elastic, system, step, start
        self._tolerance, self._penetration = tolerance, penetration
        self.free = step.prescribed.free(len(start))
        self.states = self._before = system.begun(states, start, step.before)
        self.jump = np.zeros_like(start)
        self._pressures: Array | None = None
        self._iteration, self._settled, self._same_for, self._stumbles = -1, False, 0, 0
        self.restarts = 0
        if guess is not None:
            self.u = guess_held(step, guess)
            # a guess squeezes elements here and there: their false pressures would make K indefinite, those of the
            # equilibrium before do not
            self._pressures = elastic.pressures(start)
        else:
            self.u = start.copy()
            self.jump = guess_held(step, start) - start
        self._normals = system.normals(self.u)
        self._seen = (system.points(self.u, step, self._normals), self.u)
        self.contact = self.forces(self._seen[0], self.u, ActiveSet.FROZEN)

    @property
    def turn(self) -> int:
        """Iterations since the search began."""
        return self._iteration

    @property
    def alternating(self) -> bool:
        """Whether the fixed-point phase is over, and steps and multipliers take turns."""
        return self.turn >= _FIXED_POINT or self.restarts > 0

    @property
    def predicts(self) -> ActiveSet:
        """What decides on the active set after a linear solve."""
        return ActiveSet.TRIAL if self.alternating else ActiveSet.PREDICTED

    @property
    def arrived(self) -> bool:
        """Whether what is prescribed is where it is to be."""
        return not self.jump.any()

    def forces(
        self, points: list[ContactPoints], u: Array, decides: ActiveSet, *, coupled: bool = False
    ) -> ContactForces:
        """Contact forces at points of displacement u (3N,), with the present multipliers."""
        return self.system.forces(points, u - self.start, self.states, self.step.allowed, decides, coupled=coupled)

    def predicted(self, move: Array) -> list[ContactTractions]:
        """Tractions after a move (3N,), by the linear model."""
        return self.system.predicted(self.contact, self.states, move, self.step.allowed, self.predicts)

    def pull(self, u: Array) -> Array:
        """External less internal forces of the bodies alone at displacement u [N], shape (3N,)."""
        return self.elastic.external(self.step.loads, u) - self.elastic.forces(u).forces

    def left_over(self) -> float:
        """Forces that do not balance at what is free, their size [N]."""
        return norm(np.where(self.free, self.pull(self.u) + self.contact.forces, 0.0))

    def assemble(self) -> None:
        """Find the forces, and what of them is left over."""
        self._iteration += 1
        elastic, u, free, contact = self.elastic, self.u, self.free, self.contact
        self.tangent = elastic.at(u, self._pressures, self.step.loads)
        external = elastic.external(self.step.loads, u)
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
        return self._quiet or (self.system.settled(self.contact, self.states, self._negligible) and self._lawful())

    def _lawful(self) -> bool:
        """Whether friction acts against slip: what the multipliers took to slide may slide another way by now."""
        if not any(t.friction.any() for t in self.contact.tractions):
            return True
        found = self.forces(self.contact.points, self.u, ActiveSet.TRIAL, coupled=self.contact.coupled)
        return self.system.settled(found, self.states, self._negligible)

    def confirmed(self) -> bool:
        """Whether the points see what is so; where not, the search goes on, carefully, with points that do: it is near
        a solution, and full steps would only lead away from it again (what touches may depend on which they are)."""
        self._normals = self.system.normals(self.u)
        fresh = self.system.points(self.u, self.step, self._normals)
        if self.step.allowed > 0.0:
            return True
        if self.system.mismatch(fresh, self.contact.points, self.contact.tractions) <= self._penetration:
            return True
        self._seen, self._settled = (fresh, self.u), False
        self.restarts += 1
        self.contact = self.forces(fresh, self.u, ActiveSet.TRIAL)
        return False

    def equilibrium(self) -> Equilibrium:
        """What was found."""
        contact = self.contact
        nothing = np.zeros_like(self.u)
        kept = self.system.updated(self.states, contact, contact.tractions, nothing, ActiveSet.TRIAL)
        left = 1.0 if self.step.allowed > 0.0 else 0.0  # what was parted stays so
        kept = [replace(s, slip_anchor=np.zeros_like(s.slip_anchor), allowance=left * s.allowance) for s in kept]
        # on the way to where friction took hold of it, what was apart slid on nothing
        known = zip(contact.slips, self.states, contact.points, strict=True)
        slips = [slip - s.slip_anchor[p.sites] for slip, s, p in known]
        return Equilibrium(self.u, self._reactions, contact.points, contact.tractions, slips, kept, self.unbalanced)

    def linearise(self) -> None:
        """Find what a symmetric stiffness leaves out."""
        pressed = self.states if self._iteration >= _MULTIPLIERS_GOOD else self._before
        self.contact = self.system.linearise(self.contact, self.states, pressed, self.u)

    def advance(self, move: Array, length: float) -> None:
        """Go a part of the way along a move (3N,), then update multipliers and contact points."""
        alternating, decides = self.alternating, self.predicts
        move = length * move
        self._pressures = self.elastic.pressures(self.u, move)
        self.u = self.u + move
        self.jump = self.jump * (1.0 - length)
        if length == 1.0:
            self.u = guess_held(self.step, self.u)
            self.jump = np.zeros_like(self.u)
        predicted = self.predicted(move)
        same = same_active_set(self.contact.tractions, predicted)
        self._same_for = self._same_for + 1 if same else 0
        if not alternating or same:
            self.states = self.system.updated(self.states, self.contact, predicted, move, decides)
        points, last = self._points(predicted), alternating or self.turn + 1 >= _FIXED_POINT
        sticks = any((t.active & t.sticking).any() for t in predicted)
        if self.contact.coupled and sticks and length < _SHORT:
            self._stumbles += 1
        coupled = same and (last or self._same_for >= _SAME) and not (sticks and self._stumbles >= _STUMBLES)
        self.contact = self.forces(points, self.u, ActiveSet.TRIAL if last else ActiveSet.FROZEN, coupled=coupled)

    def points_at(self, u: Array) -> list[ContactPoints]:
        """Points at displacement u (3N,), as a search that goes there has them: where gaps no longer change by seeing
        points afresh, those seen last, moved."""
        if not self._settled:
            return self.system.points(u, self.step, self.system.normals(u))
        return self.system.refreshed(self._moved(u), u, self.step)

    def _moved(self, u: Array) -> list[ContactPoints]:
        """The points seen last at displacement u (3N,), by the linear model."""
        return [shifted(p, (u - self._seen[1]).reshape(-1, 3)) for p in self._seen[0]]

    def _points(self, predicted: list[ContactTractions]) -> list[ContactPoints]:
        """Points after a move: seen afresh until that no longer changes the gaps."""
        stale = self._settled and not all(interface.slides for interface in self.system.interfaces)
        if stale and np.abs(self.u - self._seen[1]).max() > _STALE * self.system.reach:
            self._settled = False
            self._seen = (self.system.points(self.u, self.step, self.system.normals(self.u)), self.u)
            return self._seen[0]
        points = self._moved(self.u)
        if not self._settled:
            self._normals = self.system.turned(self._normals, self.u, self._iteration < _TURNING)
            fresh = self.system.points(self.u, self.step, self._normals)
            if self._iteration > _TURNING:
                self._settled = self.system.mismatch(fresh, points, predicted) <= 0.5 * self._penetration
            if not self._settled:
                self._seen, points = (fresh, self.u), fresh
        return self.system.refreshed(points, self.u, self.step) if self._settled else points


def guess_held(step: LoadStep, u: Array) -> Array:
    """A displacement (3N,) with the prescribed values where there are such."""
    out = np.array(u, dtype=np.float64).reshape(-1)
    out[step.prescribed.degrees] = step.prescribed.values
    return out
