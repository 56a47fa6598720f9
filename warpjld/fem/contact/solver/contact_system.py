"""Contact forces, tangents and multiplier updates of all interfaces (augmented Lagrangian; see ``contact.solver``)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.fem.contact.law.multipliers import elastic_multipliers, update_multipliers
from warpjld.fem.contact.law.return_mapping import ContactTractions, return_mapping
from warpjld.fem.contact.solver.first_states import farthest_carried, stuck_again
from warpjld.fem.contact.solver.tangent import friction_coupling, linearise_mortar
from warpjld.fem.load.inertia import Inertia
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed

__all__ = [
    "GRAZING",
    "IMMOBILE",
    "ContactForces",
    "ContactSystem",
    "LoadStep",
]

GRAZING = 0.02
"""Overlap of two prescribed sides, in element edges, that counts as touching; more is reported as blocked."""
IMMOBILE = 1e-9
"""Mobility (see ``mobility``) below which a point counts as prescribed along its normal."""
_STILL = 1e-9
"""Change of a prescribed displacement in a step, over the bodies' size, that is none."""
_SETTLED = 2e-3
"""Convergence tolerance of the multipliers: change relative to the contact forces, (6) of ``contact.solver``."""
_SLIGHT = 0.01
"""Penetration over what is admissible, below which redundant multipliers need not settle."""
_SLOW = 0.1
"""Fraction of the penetration remaining after a linear solve above which the penalty of a site is raised."""
_STIFFER, _STIFFEST = 5.0, 3125.0
"""Factor by which a penalty is raised, and largest total factor."""


@dataclass(frozen=True, eq=False)
class LoadStep:
    """A load step.

    Attributes:
        before: Time at its start.
        time: Time at its end.
        prescribed: Dirichlet conditions at ``time``.
        loads: Loads at ``time``.
        allowed: Fraction of the initial overlap that is still admissible at ``time``.
        inertia: Inertia in an implicit Euler step of that length; None: a quasi-static step.
        held: Whether Dirichlet conditions, inertia or a viscous medium resist every rigid motion of every body.
    """

    before: float
    time: float
    prescribed: Prescribed
    loads: Loads
    allowed: float
    inertia: Inertia | None = None
    held: bool = False

    @property
    def dragged(self) -> Array | None:
        """Stiffness with which a viscous medium resists motion since the start of the step [N/m], shape (N,)."""
        return None if self.loads.drag is None else self.loads.drag / (self.time - self.before)


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Contact forces at a configuration.

    Attributes:
        points: Contact points of each interface.
        slips: Slips of the points of each interface since the start of the step [m], shape (m, 3).
        tractions: Tractions of each interface.
        forces: Nodal forces of all interfaces [N], shape (3N,).
        coupled: Whether friction is bounded by the current pressure (Coulomb) instead of the multiplier (Tresca).
        nonsymmetric: Non-symmetric part E of the tangent [N/m], ``csr_array`` (3N, 3N); None if it vanishes or was not
            computed (``ContactSystem.linearise``).
    """

    points: list[ContactPoints]
    slips: list[Array]
    tractions: list[ContactTractions]
    forces: Array
    coupled: bool = False
    nonsymmetric: Any = None


class ContactSystem:
    """Contact contributions of all interfaces to forces, tangent and multipliers.

    Args:
        nodes: Rest positions of the bodies' nodes [m], shape (N, 3).
        interfaces: Contact interfaces.
        moduli: Contact modulus E* at each interface's slave nodes [Pa].
        penalty: Penalty ε times edge over E*.
        penetration: Admissible penetration, relative to an element edge.
    """

    def __init__(
        self, nodes: Array, interfaces: list[Interface], moduli: list[Array], *, penalty: float, penetration: float
    ) -> None:
        self.interfaces = interfaces
        self._rest = nodes
        self._penetration = penetration
        self._penalties = [penalty * (i.share @ m) / i.edge for i, m in zip(interfaces, moduli, strict=True)]

    @property
    def reach(self) -> float:
        """Smallest search distance of all interfaces [m]."""
        return min(interface.reach for interface in self.interfaces)

    def normals(self, u: Array) -> list[Array]:
        """Normals of every interface's slave nodes at displacement u (3N,)."""
        x = self._rest + u.reshape(-1, 3)
        return [interface.slave.normals(x) for interface in self.interfaces]

    def turned(self, normals: list[Array], u: Array, every: bool) -> list[Array]:
        """Normals updated to displacement u (3N,): of all interfaces, or of deformable unbonded ones only."""
        fresh = zip(self.interfaces, normals, self.normals(u), strict=True)
        return [new if every or interface.slides else old for interface, old, new in fresh]

    def points(self, u: Array, step: LoadStep, normals: list[Array]) -> list[ContactPoints]:
        """Contact points of every interface at displacement u (3N,)."""
        x = self._rest + u.reshape(-1, 3)
        found = [i.points(x, step.before, step.time, n) for i, n in zip(self.interfaces, normals, strict=True)]
        return self._without_grazing(found, step)

    def refreshed(self, points: list[ContactPoints], u: Array, step: LoadStep) -> list[ContactPoints]:
        """Points searched again at displacement u (3N,) where the tangent has their derivatives; others unchanged."""
        x = self._rest + u.reshape(-1, 3)
        known = zip(self.interfaces, points, strict=True)
        return self._without_grazing([i.points(x, step.before, step.time) if i.slides else p for i, p in known], step)

    def _without_grazing(self, points: list[ContactPoints], step: LoadStep) -> list[ContactPoints]:
        """Points with slight overlaps of two prescribed sides set to gap 0, as no force could separate them."""
        free = step.prescribed.free(self._rest.size)
        out = list(points)
        for k, (interface, p) in enumerate(zip(self.interfaces, points, strict=True)):
            slight = (p.gap < 0.0) & (p.gap > -GRAZING * interface.edge[p.sites])
            if slight.any():
                fixed = slight & (p.mobility(free) < IMMOBILE)
                out[k] = replace(p, gap=np.where(fixed, 0.0, p.gap)) if fixed.any() else p
        return out

    def forces(
        self,
        points: list[ContactPoints],
        moved: Array,
        states: list[ContactState],
        allowed: float,
        decides: ActiveSet,
        *,
        coupled: bool = False,
    ) -> ContactForces:
        """Contact forces at points, after a displacement ``moved`` (3N,) since the start of the step."""
        slips = [p.relative(moved.reshape(-1, 3)) - p.carried for p in points]
        tractions = self._tractions(points, slips, states, allowed, decides, coupled)
        return ContactForces(points, slips, tractions, self.nodal(points, tractions), coupled)

    def predicted(
        self, contact: ContactForces, states: list[ContactState], move: Array, allowed: float, decides: ActiveSet
    ) -> list[ContactTractions]:
        """Tractions after a move (3N,) by the linearised contact kinematics; the next multipliers."""
        slips = self._slips(contact, move)
        points = [p.shifted(move.reshape(-1, 3)) for p in contact.points]
        return self._tractions(points, slips, states, allowed, decides, contact.coupled)

    def _tractions(
        self,
        points: list[ContactPoints],
        slips: list[Array],
        states: list[ContactState],
        allowed: float,
        decides: ActiveSet,
        coupled: bool,
    ) -> list[ContactTractions]:
        return [
            return_mapping(i.pair, p, s, slip, self._penalty(k, p, s), allowed, decides, coupled=coupled)
            for k, (i, p, s, slip) in enumerate(zip(self.interfaces, points, states, slips, strict=True))
        ]

    def _slips(self, contact: ContactForces, move: Array) -> list[Array]:
        """Slips after a move (3N,) [m]."""
        return [s + p.relative(move.reshape(-1, 3)) for s, p in zip(contact.slips, contact.points, strict=True)]

    def nodal(self, points: list[ContactPoints], tractions: list[ContactTractions]) -> Array:
        """Nodal forces of all interfaces [N], shape (3N,)."""
        total = np.zeros_like(self._rest)
        for p, t in zip(points, tractions, strict=True):
            total += p.forces(t.traction(p))
        return total.reshape(-1)

    def linearise(
        self, contact: ContactForces, states: list[ContactState], pressed: list[ContactState], u: Array
    ) -> ContactForces:
        """Contact forces with the non-symmetric part of the tangent added, for points at displacement u (3N,).

        ``states`` are the current contact states; ``pressed`` those whose multipliers turn with the normals.
        """
        x = self._rest + u.reshape(-1, 3)
        points, parts = list(contact.points), []
        for k, (interface, p, t) in enumerate(zip(self.interfaces, points, contact.tractions, strict=True)):
            penalty = self._penalty(k, p, states[k])
            if interface.mortar is not None and interface.slides:
                found = linearise_mortar(interface.mortar, p, t, pressed[k], penalty, x, interface.reach)
                if found is not None:
                    points[k] = replace(p, gap_derivative=found.gap)
                    parts.append(found.forces)
            if contact.coupled and interface.pair.friction > 0.0:
                parts.append(friction_coupling(points[k], t, interface.pair.friction, penalty))
        known = [part for part in parts if part is not None]
        return replace(contact, points=points, nonsymmetric=sum(known[1:], known[0]) if known else None)

    def updated(
        self,
        states: list[ContactState],
        contact: ContactForces,
        predicted: list[ContactTractions],
        move: Array,
        decides: ActiveSet,
        *,
        ended: bool = False,
        slides: bool = False,
    ) -> list[ContactState]:
        """Contact states after a move (3N,) with predicted tractions (multiplier update); ``ended``: of a step;
        ``slides``: as in ``update_multipliers``."""
        out = []
        for k, (slip, s, p, t) in enumerate(
            zip(self._slips(contact, move), states, contact.points, predicted, strict=True)
        ):
            now, penalty = contact.tractions[k], self._penalty(k, p, s)
            pair = self.interfaces[k].pair
            new = update_multipliers(pair, s, p, t, slip, penalty, now.active, decides, slides=slides)
            new = elastic_multipliers(pair, s, new, ended=ended)
            out.append(replace(new, stiffening=self._stiffer(k, new, p, now, t)))
        return out

    def _stiffer(
        self,
        k: int,
        state: ContactState,
        points: ContactPoints,
        before: ContactTractions,
        predicted: ContactTractions,
    ) -> Array:
        """Penalty factors, raised where multipliers converge slowly because the bodies are stiff, shape (s,)."""
        at = points.sites
        seen = before.active & predicted.active & (before.error > self._penetration * self.interfaces[k].edge[at])
        slow = at[seen & (predicted.error > _SLOW * before.error)]
        out = state.stiffening.copy()
        out[slow] = np.minimum(_STIFFER * out[slow], _STIFFEST)
        return out

    def _penalty(self, k: int, points: ContactPoints, state: ContactState) -> Array:
        """Penalty ε of points [Pa/m]."""
        return np.asarray((self._penalties[k] * state.stiffening)[points.sites])

    def begun(self, states: list[ContactState], start: Array, step: LoadStep) -> list[ContactState]:
        """States with ``open_before`` set for the start of a step, on interfaces with friction.

        With inertia no site slides freely before contact begins: friction acts on the velocity at the end of the step.
        Where contact alone holds a body and nothing prescribed moves, ``stuck_again`` gives the states.
        """
        x, known = self._rest + start.reshape(-1, 3), step.prescribed
        if not step.held:
            moved = float(np.abs(known.values - start[known.degrees]).max(initial=0.0))
            moved = max(moved, farthest_carried(self.interfaces, x, step.before, step.time))
            still = moved <= _STILL * float(np.ptp(self._rest, axis=0).max())
            states = stuck_again(self.interfaces, states) if still else states
        out = []
        for interface, s in zip(self.interfaces, states, strict=True):
            if interface.pair.friction > 0.0:
                points = interface.points(x, step.before, step.before)
                apart = np.full(len(s.open_before), step.inertia is None)
                apart[points.sites] &= points.gap > self._penetration * interface.edge[points.sites]
                s = replace(s, open_before=apart)
            out.append(s)
        return out

    def settled(self, contact: ContactForces, states: list[ContactState], negligible: float) -> bool:
        """Whether the multipliers have converged: penetration is admissible, and forces change by less than the
        tolerance, or than ``negligible`` [N].

        Where two sides are bonded and both stick to a third, constraints are redundant, and their multipliers may go on
        changing without any effect. Changes that cancel at the nodes count as settled if penetration is far below what
        is admissible.
        """
        deepest, settled, total = 0.0, True, 0.0
        changed = np.zeros_like(self._rest)
        for k, (p, t, s) in enumerate(zip(contact.points, contact.tractions, states, strict=True)):
            if not t.active.any():
                continue
            deepest = max(deepest, float((t.error / self.interfaces[k].edge[p.sites]).max()))
            if deepest > self._penetration:
                return False
            if self.interfaces[k].pair.elastic:
                continue
            pressure, friction = t.pressure - s.pressure[p.sites], t.friction - s.friction[p.sites]
            change = p.area @ (np.abs(pressure) + np.linalg.norm(friction, axis=1))
            size = float(p.area @ (np.abs(t.pressure) + np.linalg.norm(t.friction, axis=1)))
            settled = settled and change <= max(_SETTLED * size, negligible)
            total += size
            changed += p.forces(friction - pressure[:, None] * p.normal)
        if settled or deepest > _SLIGHT * self._penetration:
            return settled
        return bool(np.linalg.norm(changed, axis=1).sum() <= max(_SETTLED * total, negligible))

    def mismatch(
        self, fresh: list[ContactPoints], points: list[ContactPoints], tractions: list[ContactTractions]
    ) -> float:
        """Largest difference between gaps searched again and those used, at active or overlapping points, in element
        edges."""
        worst = 0.0
        for interface, p, t, q in zip(self.interfaces, points, tractions, fresh, strict=True):
            edge = interface.edge
            active = np.zeros(len(edge), dtype=bool)
            active[p.sites] = t.active
            used = np.full(len(edge), np.inf)
            used[p.sites] = p.gap
            off = np.abs(q.gap - used[q.sites])
            off = np.where(active[q.sites], off, np.minimum(off, np.maximum(-q.gap, 0.0)))
            worst = max(worst, float((off / edge[q.sites]).max(initial=0.0)))
        return worst
