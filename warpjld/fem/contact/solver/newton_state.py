"""Iterate of Newton's method in a load step: displacement, contact states and residual, and their update."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from warpjld.fem.arrays import Array, norm
from warpjld.fem.body import Tangent
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.fem.contact.law.return_mapping import ContactTractions, same_active_set
from warpjld.fem.contact.solver.contact_system import ContactForces, ContactSystem, LoadStep
from warpjld.fem.contact.solver.elastic import Elastic

__all__ = ["Equilibrium", "NewtonState", "guess_held"]

_ROUNDING = 1e-13
"""Relative rounding error of internal forces, over stiffness times displacement."""
_PLACES = 0.03
"""Weight in that error of stiffness times body size: gaps are differences of positions."""
_TURNING = 1
"""Iterations after which normals without known derivatives are frozen; weights are updated until gaps no longer change.
Both are verified at convergence (``confirmed``)."""
_STALE = 0.025
"""Motion of a node since the last search for contact points, relative to the search distance, beyond which points are
searched again: on a curved surface, the error of the gap grows with its square."""
_FIXED_POINT = 8
"""Iterations of the fixed-point phase."""
_SAME, _SAME_STICKING = 2, 4
"""Successive iterations with the same active set after which friction is bounded by the current pressure (alternating
between pressure and friction converges slowly): where all points slide, and where some stick. The latter have hardly
found where they stick before: steps in which three fingers first touched a ball took 19 to 28 solves with 2, 11 with 4.
"""
_ALIGNED, _ALIGNED_FREE = 0.005, 0.05
"""Residual below which friction that is bounded by the current pressure also has the direction of its trial traction,
and the same where a body is held by contact alone: the direction found in the fixed-point phase comes nearer by a
factor of about 0.6 an iteration only. Steps of a block between two fingertips took 7 solves instead of 10 or 11, those
of a ball between thumb and finger 9 to 11 instead of 11; with 0.05 a hand that closed on a box took 5.8 a step instead
of 4.4."""
_SHORT, _STUMBLES = 0.1, 2
"""Step length of coupled friction beside sticking points that counts as a stumble, and number of stumbles after which
friction is no longer coupled: points at the limit of sticking alternate then."""
_MULTIPLIERS_GOOD = 1
"""Iterations after which multipliers are used in derivatives of normals; before that, those of the last equilibrium."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Equilibrium at the end of a load step.

    Attributes:
        displacement: [m], shape (3N,).
        reactions: Forces at prescribed degrees of freedom [N], zero elsewhere, shape (3N,).
        points, tractions: Contact points of each interface, and their tractions.
        slips: Slips of the points in the step, with friction [m], shape (m, 3) for each interface.
        states: Contact states for the next step.
        residual: Relative residual.
    """

    displacement: Array
    reactions: Array
    points: list[ContactPoints]
    tractions: list[ContactTractions]
    slips: list[Array]
    states: list[ContactState]
    residual: float


class NewtonState:
    """Iterate of the search for the equilibrium at the end of a load step.

    Args:
        elastic: The bodies.
        system: Their contact.
        step: The load step.
        start: Displacement at its start [m], shape (3N,).
        states: Contact states there.
        guess: Initial guess [m], shape (3N,), without inverted elements; None: ``start``, with the Dirichlet values
            applied in the first Newton step.
        tolerance: Residual relative to the forces in balance.
        penetration: Admissible penetration, relative to an element edge.

    Attributes:
        u: Displacement [m], shape (3N,).
        jump: Remaining increment of prescribed degrees of freedom [m], shape (3N,).
        free: Mask of degrees of freedom that are not prescribed, shape (3N,).
        states: Contact states with multipliers and active sets.
        contact: Contact forces at ``u``.
        tangent: Internal forces and stiffness of the bodies at ``u``.
        residual: Residual at free degrees of freedom [N], shape (3N,).
        unbalanced: Norm of the residual relative to the forces in balance.
        restarts: How often the search converged but contact points, searched again, did not agree.
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
        self.states = self._before = system.begun(states, start, step)
        self.jump = np.zeros_like(start)
        self._pressures: Array | None = None
        self._iteration, self._settled, self._same_for, self._stumbles = -1, False, 0, 0
        self._aligned = False
        self.restarts = 0
        if guess is not None:
            self.u = guess_held(step, guess)
            # a guess compresses single elements, whose spurious pressures would make K indefinite; those of the
            # previous equilibrium do not
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
        """Whether the alternating phase has begun."""
        return self.turn >= _FIXED_POINT or self.restarts > 0

    @property
    def predicts(self) -> ActiveSet:
        """Rule for the active set after a linear solve."""
        return ActiveSet.TRIAL if self.alternating or self._aligned else ActiveSet.PREDICTED

    @property
    def arrived(self) -> bool:
        """Whether the Dirichlet values are reached."""
        return not self.jump.any()

    def forces(
        self, points: list[ContactPoints], u: Array, decides: ActiveSet, *, coupled: bool = False
    ) -> ContactForces:
        """Contact forces at points of displacement u (3N,), with the current multipliers."""
        return self.system.forces(points, u - self.start, self.states, self.step.allowed, decides, coupled=coupled)

    def predicted(self, move: Array) -> list[ContactTractions]:
        """Tractions after a move (3N,), by linearised kinematics."""
        return self.system.predicted(self.contact, self.states, move, self.step.allowed, self.predicts)

    def pull(self, u: Array) -> Array:
        """External and minus internal forces of the bodies at displacement u, without contact [N], shape (3N,)."""
        return self._external(u) - self.elastic.forces(u).forces

    def _external(self, u: Array) -> Array:
        """External, inertial and viscous forces at displacement u [N], shape (3N,)."""
        loads = self.elastic.external(self.step.loads, u)
        if (drag := self.step.dragged) is not None:
            loads = loads - np.repeat(drag, 3) * (u - self.start)
        return loads if self.step.inertia is None else loads + self.step.inertia.force(u)

    def left_over(self) -> float:
        """Norm of the residual at free degrees of freedom [N]."""
        return norm(np.where(self.free, self.pull(self.u) + self.contact.forces, 0.0))

    def assemble(self) -> None:
        """Evaluate forces, tangent and residual at u."""
        self._iteration += 1
        elastic, u, free, contact = self.elastic, self.u, self.free, self.contact
        self.tangent = elastic.at(u, self._pressures, self.step.loads)
        external, inertia = self._external(u), self.step.inertia
        self.residual = np.where(free, external + contact.forces - self.tangent.forces, 0.0)
        self._reactions = np.where(free, 0.0, self.tangent.forces - external - contact.forces)
        pushed = norm(np.where(free, contact.forces, 0.0))
        moved = norm(np.repeat(elastic.stiffness, 3) * u)
        scale = max(norm(external), pushed, norm(self._reactions), 1e-300)
        if inertia is not None:
            scale, moved = max(scale, norm(inertia.force(u))), moved + inertia.rounding(u)
        self.unbalanced = norm(self.residual) / scale
        noise = _ROUNDING * (moved + _PLACES * norm(elastic.stiffness) * elastic.body.mesh.size)
        self._negligible = max(self._tolerance * scale, noise)
        self._near = self.unbalanced <= max(self._tolerance, noise / scale)
        self._quiet = pushed <= noise

    def balanced(self) -> bool:
        """Whether the convergence criteria (6) hold with the current contact points."""
        if not (self.arrived and self._near):
            return False
        return self._quiet or (self.system.settled(self.contact, self.states, self._negligible) and self._lawful())

    def _lawful(self) -> bool:
        """Whether friction opposes slip, whose direction may have changed since the multipliers were updated."""
        if not any(t.friction.any() for t in self.contact.tractions):
            return True
        found = self.forces(self.contact.points, self.u, ActiveSet.TRIAL, coupled=self.contact.coupled)
        return self.system.settled(found, self.states, self._negligible)

    def confirmed(self) -> bool:
        """Whether contact points, searched again at u, agree with the current ones.

        If not, the search continues with the new points in the alternating phase, as it is near a solution and full
        steps would lead away from it.
        """
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
        """The equilibrium at u, with contact states for the next step."""
        contact = self.contact
        zero = np.zeros_like(self.u)
        kept = self.system.updated(self.states, contact, contact.tractions, zero, ActiveSet.TRIAL, ended=True)
        left = 1.0 if self.step.allowed > 0.0 else 0.0  # once removed, initial overlaps are no longer admissible
        kept = [replace(s, slip_anchor=np.zeros_like(s.slip_anchor), allowance=left * s.allowance) for s in kept]
        # sliding before contact began is not slip
        known = zip(contact.slips, self.states, contact.points, strict=True)
        slips = [slip - s.slip_anchor[p.sites] for slip, s, p in known]
        return Equilibrium(self.u, self._reactions, contact.points, contact.tractions, slips, kept, self.unbalanced)

    def linearise(self) -> None:
        """Evaluate the non-symmetric part E of the tangent."""
        pressed = self.states if self._iteration >= _MULTIPLIERS_GOOD else self._before
        self.contact = self.system.linearise(self.contact, self.states, pressed, self.u)

    def advance(self, move: Array, length: float) -> None:
        """Advance along a move (3N,) by a step length, then update multipliers and contact points."""
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
            slides = self.step.held  # the slip of a body that friction has to hold is not known without friction
            self.states = self.system.updated(self.states, self.contact, predicted, move, decides, slides=slides)
        points, last = self._points(predicted), alternating or self.turn + 1 >= _FIXED_POINT
        sticks = any((t.active & t.sticking).any() for t in predicted)
        if self.contact.coupled and sticks and length < _SHORT:
            self._stumbles += 1
        enough = _SAME_STICKING if sticks else _SAME
        coupled = same and (last or self._same_for >= enough) and not (sticks and self._stumbles >= _STUMBLES)
        self._aligned = coupled and self.unbalanced < (_ALIGNED if self.step.held else _ALIGNED_FREE)
        rule = ActiveSet.TRIAL if last or self._aligned else ActiveSet.FROZEN
        self.contact = self.forces(points, self.u, rule, coupled=coupled)

    def points_at(self, u: Array) -> list[ContactPoints]:
        """Contact points at displacement u (3N,), as used by a line search: those of the last search, moved, once
        searching again no longer changes gaps."""
        if not self._settled:
            return self.system.points(u, self.step, self.system.normals(u))
        return self.system.refreshed(self._moved(u), u, self.step)

    def _moved(self, u: Array) -> list[ContactPoints]:
        """Contact points of the last search at displacement u (3N,), by the linear model."""
        return [p.shifted((u - self._seen[1]).reshape(-1, 3)) for p in self._seen[0]]

    def _points(self, predicted: list[ContactTractions]) -> list[ContactPoints]:
        """Contact points after a move, searched again until that no longer changes the gaps."""
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
    """A displacement (3N,) with the Dirichlet values of a step inserted."""
    out = np.array(u, dtype=np.float64).reshape(-1)
    out[step.prescribed.degrees] = step.prescribed.values
    return out
