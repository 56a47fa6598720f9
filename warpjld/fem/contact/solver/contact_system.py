"""Contact forces, tangents and multiplier updates of all interfaces (augmented Lagrangian; see ``contact.solver``)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.fem.contact.law.multipliers import update_multipliers
from warpjld.fem.contact.law.return_mapping import ContactTractions, return_mapping
from warpjld.fem.contact.solver.tangent import friction_coupling, linearise_mortar
from warpjld.fem.load.loads import Loads
from warpjld.fem.load.prescribed import Prescribed

__all__ = [
    "GRAZING",
    "IMMOBILE",
    "ContactForces",
    "ContactSystem",
    "LoadStep",
    "mobility",
    "same_active_set",
    "shifted",
]

GRAZING = 0.02
"""Edges by which sides that are both prescribed may overlap: more is said, and less is as if they touched."""
IMMOBILE = 1e-9
"""Share of a point's weights that must be free to move along its normal for it to be parted."""
_SETTLED = 2e-3
"""Share of the contact forces by which the multipliers may still change."""
_SLOW = 0.1
"""Share of the overlap that a linear solve may leave; where it leaves more, the penalty grows,"""
_STIFFER, _STIFFEST = 5.0, 3125.0
"""by the one factor, up to the other."""


@dataclass(frozen=True, eq=False)
class LoadStep:
    """A load step.

    Attributes:
        before: Time it starts from.
        time: Time it goes to.
        prescribed: Displacements at ``time``.
        loads: Loads at ``time``.
        allowed: Share of the overlap at the start that is still allowed at ``time``.
    """

    before: float
    time: float
    prescribed: Prescribed
    loads: Loads
    allowed: float


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Every interface's points, slips [m] and tractions, and their nodal forces together [N], shape (3N,).

    Attributes:
        coupled: Whether friction follows the pressure as it is, and not the multipliers'.
        nonsymmetric: What a symmetric stiffness leaves out [N/m], ``csr_array`` (3N, 3N); None where nothing is or it
            was not asked for (``ContactSystem.linearise``).
    """

    points: list[ContactPoints]
    slips: list[Array]
    tractions: list[ContactTractions]
    forces: Array
    coupled: bool = False
    nonsymmetric: Any = None


class ContactSystem:
    """Interfaces between bodies.

    Args:
        nodes: Rest positions of the bodies' nodes [m], shape (N, 3).
        interfaces: What may touch.
        moduli: E* at each interface's slave nodes [Pa].
        penalty: Contact stiffness over E* by the edge of a face.
        penetration: Overlap left, as a share of an edge.
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
        """How far ahead the least far-sighted interface looks [m]."""
        return min(interface.reach for interface in self.interfaces)

    def normals(self, u: Array) -> list[Array]:
        """Of every interface's slave nodes at displacement u (3N,)."""
        x = self._rest + u.reshape(-1, 3)
        return [interface.slave.normals(x) for interface in self.interfaces]

    def turned(self, normals: list[Array], u: Array, every: bool) -> list[Array]:
        """Normals at displacement u (3N,): of surfaces that meet surfaces, or of every one; the others stay."""
        fresh = zip(self.interfaces, normals, self.normals(u), strict=True)
        return [new if every or interface.slides else old for interface, old, new in fresh]

    def points(self, u: Array, step: LoadStep, normals: list[Array]) -> list[ContactPoints]:
        """Every interface's points at displacement u (3N,)."""
        x = self._rest + u.reshape(-1, 3)
        found = [i.points(x, step.before, step.time, n) for i, n in zip(self.interfaces, normals, strict=True)]
        return self._parted(found, step)

    def refreshed(self, points: list[ContactPoints], u: Array, step: LoadStep) -> list[ContactPoints]:
        """Points between surfaces as displacement u (3N,) has them, since their derivatives are known; others stay."""
        x = self._rest + u.reshape(-1, 3)
        known = zip(self.interfaces, points, strict=True)
        return self._parted([i.points(x, step.before, step.time) if i.slides else p for i, p in known], step)

    def _parted(self, points: list[ContactPoints], step: LoadStep) -> list[ContactPoints]:
        """Points with what is prescribed on both sides touching, not overlapping, where it does so slightly: no force
        can part it, and none is meant."""
        free = step.prescribed.free(self._rest.size)
        out = list(points)
        for k, (interface, p) in enumerate(zip(self.interfaces, points, strict=True)):
            slight = (p.gap < 0.0) & (p.gap > -GRAZING * interface.edge[p.sites])
            if slight.any():
                fixed = slight & (mobility(p, free) < IMMOBILE)
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
        """Contact forces at points when bodies have moved (3N,) since the start of the step."""
        slips = [p.relative(moved.reshape(-1, 3)) - p.carried for p in points]
        tractions = self._tractions(points, slips, states, allowed, decides, coupled)
        return ContactForces(points, slips, tractions, self.nodal(points, tractions), coupled)

    def predicted(
        self, contact: ContactForces, states: list[ContactState], move: Array, allowed: float, decides: ActiveSet
    ) -> list[ContactTractions]:
        """Tractions after a move (3N,), by the linear model: the multipliers to go on with."""
        slips = self._slips(contact, move)
        points = [shifted(p, move.reshape(-1, 3)) for p in contact.points]
        # penalties and sites are those of the points before
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
        """Nodal forces of all interfaces together [N], shape (3N,)."""
        total = np.zeros_like(self._rest)
        for p, t in zip(points, tractions, strict=True):
            total += p.forces(t.traction(p))
        return total.reshape(-1)

    def linearise(
        self, contact: ContactForces, states: list[ContactState], pressed: list[ContactState], u: Array
    ) -> ContactForces:
        """With what a symmetric stiffness leaves out, where points are those of displacement u (3N,).

        ``pressed`` knows the multipliers that directions turn with; ``states`` are the present ones.
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
    ) -> list[ContactState]:
        """States after a move (3N,) that was predicted to be answered so."""
        out = []
        for k, (slip, s, p, t) in enumerate(
            zip(self._slips(contact, move), states, contact.points, predicted, strict=True)
        ):
            now, penalty = contact.tractions[k], self._penalty(k, p, s)
            s = update_multipliers(self.interfaces[k].pair, s, p, t, slip, penalty, now.active, decides)
            out.append(replace(s, stiffening=self._stiffer(k, s, p, now, t)))
        return out

    def _stiffer(
        self,
        k: int,
        state: ContactState,
        points: ContactPoints,
        before: ContactTractions,
        predicted: ContactTractions,
    ) -> Array:
        """Penalties raised where flesh is so stiff that multipliers would find their values slowly, shape (s,)."""
        at = points.sites
        seen = before.active & predicted.active & (before.error > self._penetration * self.interfaces[k].edge[at])
        slow = at[seen & (predicted.error > _SLOW * before.error)]
        out = state.stiffening.copy()
        out[slow] = np.minimum(_STIFFER * out[slow], _STIFFEST)
        return out

    def _penalty(self, k: int, points: ContactPoints, state: ContactState) -> Array:
        """ε of points [Pa/m]."""
        return np.asarray((self._penalties[k] * state.stiffening)[points.sites])

    def begun(self, states: list[ContactState], start: Array, time: float) -> list[ContactState]:
        """States that know what is apart as the step begins, where friction asks for it."""
        x = self._rest + start.reshape(-1, 3)
        out = []
        for interface, s in zip(self.interfaces, states, strict=True):
            if interface.pair.friction > 0.0:
                points = interface.points(x, time, time)
                apart = np.ones(len(s.open_before), dtype=bool)
                apart[points.sites] = points.gap > self._penetration * interface.edge[points.sites]
                s = replace(s, open_before=apart)
            out.append(s)
        return out

    def settled(self, contact: ContactForces, states: list[ContactState], negligible: float) -> bool:
        """Whether multipliers stay: overlap is gone, and forces change by little, or by what is ``negligible``."""
        for k, (p, t, s) in enumerate(zip(contact.points, contact.tractions, states, strict=True)):
            if not t.active.any():
                continue
            if (t.error / self.interfaces[k].edge[p.sites]).max() > self._penetration:
                return False
            change = np.abs(t.pressure - s.pressure[p.sites]) + np.linalg.norm(t.friction - s.friction[p.sites], axis=1)
            size = np.abs(t.pressure) + np.linalg.norm(t.friction, axis=1)
            if p.area @ change > max(_SETTLED * (p.area @ size), negligible):
                return False
        return True

    def mismatch(
        self, fresh: list[ContactPoints], points: list[ContactPoints], tractions: list[ContactTractions]
    ) -> float:
        """How far gaps as they are differ from those believed, where surfaces press or overlap, over an edge."""
        worst = 0.0
        for interface, p, t, q in zip(self.interfaces, points, tractions, fresh, strict=True):
            edge = interface.edge
            active = np.zeros(len(edge), dtype=bool)
            active[p.sites] = t.active
            believed = np.full(len(edge), np.inf)
            believed[p.sites] = p.gap
            off = np.abs(q.gap - believed[q.sites])
            off = np.where(active[q.sites], off, np.minimum(off, np.maximum(-q.gap, 0.0)))
            worst = max(worst, float((off / edge[q.sites]).max(initial=0.0)))
        return worst


def mobility(points: ContactPoints, free: Mask) -> Array:
    """Share of each point's weights that may move along its normal, of free degrees of freedom (3N,), shape (m,)."""
    return np.asarray(np.einsum("mi,mi->m", abs(points.weights) @ free.reshape(-1, 3).astype(float), points.normal**2))


def shifted(points: ContactPoints, move: Array) -> ContactPoints:
    """Points after a move (N, 3), by the linear model: their normals and weights stay."""
    return replace(points, gap=points.gap + points.opened(move)) if move.any() else points


def same_active_set(tractions: list[ContactTractions], others: list[ContactTractions]) -> bool:
    """Whether the same points touch, and stick, in both."""
    return all(
        np.array_equal(t.active, o.active) and np.array_equal(t.sticking, o.sticking)
        for t, o in zip(tractions, others, strict=True)
    )
