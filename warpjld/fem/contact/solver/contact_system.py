"""What all interfaces of a problem answer together, and what they remember between linear solves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_points import ContactPoints, Interface
from warpjld.fem.contact.law.law import ContactState, Response, remember, respond
from warpjld.fem.contact.solver.tangent import coupling, slopes_of

__all__ = ["Contact", "Interplay", "alike", "shifted"]

_SETTLED = 2e-3
"""Share of the contact forces by which the multipliers may still change."""
_SLOW = 0.1
"""Share of the overlap that a linear solve may leave; where it leaves more, the penalty grows,"""
_FIRMER, _FIRMEST = 5.0, 3125.0
"""by the one factor, up to the other."""


@dataclass(frozen=True, eq=False)
class Contact:
    """Every interface's points, slips [m] and responses, and their nodal forces together [N], shape (3N,).

    Attributes:
        coupled: Whether friction follows the pressure as it is, and not the multipliers'.
        beside: What a symmetric stiffness leaves out [N/m], ``csr_array`` (3N, 3N); None where nothing is or it was not
            asked for (``Interplay.sloped``).
    """

    points: list[ContactPoints]
    slips: list[Array]
    responses: list[Response]
    forces: Array
    coupled: bool = False
    beside: Any = None


class Interplay:
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

    def points(self, u: Array, before: float, time: float, normals: list[Array]) -> list[ContactPoints]:
        """Every interface's points at displacement u (3N,)."""
        x = self._rest + u.reshape(-1, 3)
        return [i.points(x, before, time, n) for i, n in zip(self.interfaces, normals, strict=True)]

    def turned(self, normals: list[Array], u: Array, every: bool) -> list[Array]:
        """Normals at displacement u (3N,): of surfaces that meet surfaces, or of every one; the others stay."""
        fresh = self.normals(u)
        return [
            new if every or interface.slides else old
            for interface, old, new in zip(self.interfaces, normals, fresh, strict=True)
        ]

    def refreshed(self, points: list[ContactPoints], u: Array, before: float, time: float) -> list[ContactPoints]:
        """Points between surfaces as displacement u (3N,) has them, since their derivatives are known; others stay."""
        x = self._rest + u.reshape(-1, 3)
        return [
            interface.points(x, before, time) if interface.slides else p
            for interface, p in zip(self.interfaces, points, strict=True)
        ]

    def answered(
        self,
        points: list[ContactPoints],
        u: Array,
        start: Array,
        memory: list[ContactState],
        *,
        keep: bool,
        allowed: float,
        coupled: bool = False,
    ) -> Contact:
        """What points answer at displacement u (3N,)."""
        since = (u - start).reshape(-1, 3)
        slips = [p.relative(since) - p.carried for p in points]
        responses = [
            respond(i.pair, p, m, slip, self._penalty(k, p, m), allowed, keep=keep, patient=not keep, coupled=coupled)
            for k, (i, p, m, slip) in enumerate(zip(self.interfaces, points, memory, slips, strict=True))
        ]
        return Contact(points, slips, responses, self.pushed(points, responses), coupled)

    def sloped(self, contact: Contact, memory: list[ContactState], pressed: list[ContactState], u: Array) -> Contact:
        """With what a symmetric stiffness leaves out, where points are those of displacement u (3N,).

        ``pressed`` knows the multipliers that directions turn with; ``memory`` is the present one.
        """
        x = self._rest + u.reshape(-1, 3)
        points, beside = list(contact.points), None
        for k, (interface, p, r) in enumerate(zip(self.interfaces, points, contact.responses, strict=True)):
            penalty, left_out = self._penalty(k, p, memory[k]), []
            if interface.mortar is not None and interface.slides:
                slopes = slopes_of(interface.mortar, p, r, pressed[k], penalty, x, interface.reach)
                if slopes is not None:
                    points[k] = replace(p, steep=slopes.gap)
                    left_out.append(slopes.forces)
            if contact.coupled and interface.pair.friction > 0.0:
                left_out.append(coupling(points[k], r, interface.pair.friction, penalty))
            for part in left_out:
                if part is not None:
                    beside = part if beside is None else beside + part
        return replace(contact, points=points, beside=beside)

    def pushed(self, points: list[ContactPoints], responses: list[Response]) -> Array:
        """Nodal forces of all interfaces together [N], shape (3N,)."""
        total = np.zeros_like(self._rest)
        for p, r in zip(points, responses, strict=True):
            total += p.forces(r.traction(p))
        return total.reshape(-1)

    def foreseen(
        self, contact: Contact, memory: list[ContactState], move: Array, allowed: float, *, patient: bool
    ) -> list[Response]:
        """What points answer after a move, by the linear model: the multipliers to go on with."""
        out = []
        for k, (p, m, slip) in enumerate(zip(contact.points, memory, contact.slips, strict=True)):
            there = shifted(p, move.reshape(-1, 3))
            slip = slip + p.relative(move.reshape(-1, 3))
            penalty = self._penalty(k, p, m)
            pair, coupled = self.interfaces[k].pair, contact.coupled
            out.append(respond(pair, there, m, slip, penalty, allowed, patient=patient, coupled=coupled))
        return out

    def remembered(
        self, memory: list[ContactState], contact: Contact, foreseen: list[Response], move: Array, *, patient: bool
    ) -> list[ContactState]:
        """Multipliers after a move (3N,) that was foreseen to be answered so."""
        out = []
        for k, (m, p, r) in enumerate(zip(memory, contact.points, foreseen, strict=True)):
            slip = contact.slips[k] + p.relative(move.reshape(-1, 3))
            pair, known, penalty = self.interfaces[k].pair, contact.responses[k].active, self._penalty(k, p, m)
            m = remember(pair, m, p, r, slip, penalty, known, patient=patient)
            out.append(replace(m, firm=self._firmer(k, m, p, contact.responses[k], r)))
        return out

    def _firmer(
        self, k: int, memory: ContactState, points: ContactPoints, before: Response, foreseen: Response
    ) -> Array:
        """Penalties raised where flesh is so stiff that multipliers would find their values slowly, shape (s,)."""
        at = points.sites
        seen = before.active & foreseen.active & (before.error > self._penetration * self.interfaces[k].edge[at])
        slow = at[seen & (foreseen.error > _SLOW * before.error)]
        firm = memory.firm.copy()
        firm[slow] = np.minimum(_FIRMER * firm[slow], _FIRMEST)
        return firm

    def _penalty(self, k: int, points: ContactPoints, memory: ContactState) -> Array:
        """ε of points [Pa/m]."""
        return np.asarray((self._penalties[k] * memory.firm)[points.sites])

    def begun(self, memory: list[ContactState], start: Array, time: float) -> list[ContactState]:
        """ContactState that knows what is apart as the step begins, where friction asks for it."""
        x = self._rest + start.reshape(-1, 3)
        out = []
        for interface, m in zip(self.interfaces, memory, strict=True):
            if interface.pair.friction > 0.0:
                points = interface.points(x, time, time)
                apart = np.ones(len(m.apart), dtype=bool)
                apart[points.sites] = points.gap > self._penetration * interface.edge[points.sites]
                m = replace(m, apart=apart)
            out.append(m)
        return out

    def settled(self, contact: Contact, memory: list[ContactState], negligible: float) -> bool:
        """Whether multipliers stay: overlap is gone, and forces change by little, or by what is ``negligible``."""
        for k, (p, r, m) in enumerate(zip(contact.points, contact.responses, memory, strict=True)):
            if not r.active.any():
                continue
            if (r.error / self.interfaces[k].edge[p.sites]).max() > self._penetration:
                return False
            change = np.abs(r.pressure - m.pressure[p.sites]) + np.linalg.norm(r.friction - m.friction[p.sites], axis=1)
            size = np.abs(r.pressure) + np.linalg.norm(r.friction, axis=1)
            if p.area @ change > max(_SETTLED * (p.area @ size), negligible):
                return False
        return True

    def mismatch(self, fresh: list[ContactPoints], points: list[ContactPoints], responses: list[Response]) -> float:
        """How far gaps as they are differ from those believed, where surfaces press or overlap, over an edge."""
        worst = 0.0
        for k, (p, r, q) in enumerate(zip(points, responses, fresh, strict=True)):
            edge = self.interfaces[k].edge
            active = np.zeros(len(edge), dtype=bool)
            active[p.sites] = r.active
            believed = np.full(len(edge), np.inf)
            believed[p.sites] = p.gap
            off = np.abs(q.gap - believed[q.sites])
            off = np.where(active[q.sites], off, np.minimum(off, np.maximum(-q.gap, 0.0)))
            worst = max(worst, float((off / edge[q.sites]).max(initial=0.0)))
        return worst


def shifted(points: ContactPoints, move: Array) -> ContactPoints:
    """Points after a move (N, 3), by the linear model: their normals and weights stay."""
    if not move.any():
        return points
    return replace(points, gap=points.gap + points.opened(move))


def alike(responses: list[Response], others: list[Response]) -> bool:
    """Whether the same points touch, and stick, in both."""
    return all(
        np.array_equal(r.active, s.active) and np.array_equal(r.sticking, s.sticking)
        for r, s in zip(responses, others, strict=True)
    )
