"""Pressure and friction at contact points: augmented Lagrangian, Coulomb's cone, bonds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.rotations import unit

__all__ = ["ContactState", "Response", "initial_state", "remember", "respond"]

_GRIPS = 2
_TORN = 3.0
"""Friction in excess of Coulomb's, over Coulomb's, from which pressures found beside it say nothing."""


@dataclass(frozen=True, eq=False)
class ContactState:
    """What an interface knows of each of its s sites.

    Attributes:
        pressure: Multiplier along the normal [Pa], ≥ 0 unless bonded, shape (s,).
        friction: Multiplier across it, on the slave [Pa], shape (s, 3).
        allowance: Overlap that is still allowed, where the step began inside the other body [m], shape (s,) (R112).
        gripping: Iterations for which something has pressed; friction acts from the second, when the overlap of the
            first guess is gone, shape (s,).
        apart: Whether the sides were apart when the step began, shape (s,).
        anchor: Slip at which friction took hold of what was apart when the step began [m], shape (s, 3): on its way
            there it slid freely.
        stuck: Whether friction holds it, or it slides if not, shape (s,).
        bonded: Whether the bond holds, shape (s,).
        seam: Gap at which the bond was made [m], shape (s,).
        firm: Penalty over the usual one: more where a multiplier does not find its value soon, shape (s,).
    """

    pressure: Array
    friction: Array
    allowance: Array
    gripping: Ints32
    apart: Mask
    anchor: Array
    stuck: Mask
    bonded: Mask
    seam: Array
    firm: Array


@dataclass(frozen=True, eq=False)
class Response:
    """Tractions of one interface's points.

    Attributes:
        pressure: p [Pa], shape (m,).
        friction: Tangential traction on the slave [Pa], shape (m, 3).
        active: Whether the point touches, shape (m,).
        sticking: Whether friction, or a bond, holds it, shape (m,).
        error: Overlap, or gap under pressure, that the multipliers have yet to remove [m], shape (m,).
        blocks: Stiffness times area of each point [N/m], shape (m, 3, 3).
    """

    pressure: Array
    friction: Array
    active: Mask
    sticking: Mask
    error: Array
    blocks: Array

    def traction(self, points: ContactPoints) -> Array:
        """Force per area on the slave [Pa], shape (m, 3)."""
        return self.friction - self.pressure[:, None] * points.normal


def initial_state(count: int, pair: Pair) -> ContactState:
    """Nothing touches yet; what is bonded is."""
    bonded = np.full(count, pair.bond is not None)
    return ContactState(
        pressure=np.zeros(count),
        friction=np.zeros((count, 3)),
        allowance=np.zeros(count),
        gripping=np.zeros(count, np.int32),
        apart=np.zeros(count, dtype=bool),
        anchor=np.zeros((count, 3)),
        stuck=np.ones(count, dtype=bool),
        bonded=bonded,
        seam=np.full(count, np.nan),
        firm=np.ones(count),
    )


def respond(
    pair: Pair,
    points: ContactPoints,
    memory: ContactState,
    slip: Array,
    penalty: Array,
    allowed: float,
    *,
    keep: bool = False,
    patient: bool = False,
    coupled: bool = False,
) -> Response:
    """Tractions and stiffness at points, p = max(0, λ − ε g), friction returned to Coulomb's cone (R122).

    The stiffness is symmetric: that the friction of a sliding point depends on its pressure is left to the iteration,
    or to ``slopes.coupling``.

    Args:
        pair: Friction and bond.
        points: The points.
        memory: Multipliers.
        slip: Relative displacement of the two sides since the start of the step [m], shape (m, 3).
        penalty: ε [Pa/m], shape (m,).
        allowed: Share of the memory's allowance that still counts, 0 to 1.
        keep: What pressed, by its multiplier, presses, or pulls for the moment, whatever its gap: whether it lets go is
            then for the linear solve to say, and not for the second-order error of the move before, which the penalty
            makes large (primal–dual active set).
        patient: Who sticks is read off the friction, λ − ε s, and not off the memory: tractions are then continuous,
            and with multipliers that stay the problem is convex, so that a search along a line settles it.
        coupled: Friction is bounded by the pressure as it is, and not by the multiplier's.
    """
    at = points.sites
    normal = points.normal
    bonded = memory.bonded[at]
    seam = np.nan_to_num(memory.seam[at])
    gap = np.where(bonded, points.gap - seam, points.gap + allowed * memory.allowance[at])
    pressure = memory.pressure[at] - penalty * gap
    active = bonded | (pressure > 0.0)
    if keep:
        active |= memory.pressure[at] > 0.0
    pressure = np.where(active, pressure, 0.0)
    error = np.where(active, np.minimum(np.abs(gap), np.where(bonded, np.inf, np.maximum(-gap, pressure / penalty))), 0)

    count = len(at)
    friction = np.zeros((count, 3))
    sticking = bonded.copy()
    blocks = np.zeros((count, 3, 3))
    outer = normal[:, :, None] * normal[:, None, :]
    blocks += np.where(active, points.area * penalty, 0.0)[:, None, None] * outer
    if pair.friction > 0.0 or bonded.any():
        across = np.eye(3) - outer
        slip = np.einsum("mij,mj->mi", across, slip - memory.anchor[at])
        carried = np.einsum("mij,mj->mi", across, memory.friction[at])
        # the pressure of the iterate before bounds the friction of this one: each iterate is then a convex problem
        bound = np.maximum(memory.pressure[at] if (keep or patient) and not coupled else pressure, 0.0)
        grips = active & ((memory.gripping[at] >= _GRIPS) | bonded)
        limit = np.where(grips, pair.friction * bound, 0.0)
        held = carried - penalty[:, None] * slip
        size = np.linalg.norm(held, axis=1)
        if patient:
            sticking = grips & ((size <= limit) | bonded)
            along = unit(held)
            turning = penalty * np.divide(limit, size, out=np.zeros(count), where=size > 0.0)
        else:
            sticking = grips & (memory.stuck[at] | bonded)
            along = unit(carried)
            # a sliding point resists what would turn its path, as much as it slides
            far = np.linalg.norm(slip, axis=1)
            turning = np.minimum(penalty, np.divide(limit, far, out=penalty.copy(), where=far > 0.0))
        friction = np.where(sticking[:, None], held, limit[:, None] * along)
        turning = np.where(limit > 0.0, turning, 0.0)
        beside = across - along[:, :, None] * along[:, None, :]
        tangent = np.where(sticking[:, None, None], penalty[:, None, None] * across, turning[:, None, None] * beside)
        blocks += np.where(grips, points.area, 0.0)[:, None, None] * tangent
    return Response(pressure, friction, active, sticking, error, blocks)


def remember(
    pair: Pair,
    memory: ContactState,
    points: ContactPoints,
    response: Response,
    slip: Array,
    penalty: Array,
    known: Mask,
    *,
    patient: bool = False,
) -> ContactState:
    """Multipliers after a linear solve that foresees a response and a slip (m, 3), and who sticks from now on (R122).

    What stuck slides where its friction exceeds μ p; what slid sticks where friction would push it along its path
    (``patient``: both as the response says). Of points that the solve did not know of (``known``, shape (m,)), nothing
    is remembered: penalty is not pressure. Nor of pressures under friction far beyond Coulomb's, of a step that slides
    a long way: it would tear off what in truth lies still or slides.
    """
    at = points.sites
    count = len(memory.pressure)
    normal, friction = np.zeros(count), np.zeros((count, 3))
    stuck = np.ones(count, dtype=bool)
    pressure = np.where(known, response.pressure, 0.0)
    if pair.friction > 0.0 or memory.bonded.any():
        bonded = memory.bonded[at]
        limit = pair.friction * np.maximum(pressure, 0.0)
        whole, slip = slip, slip - memory.anchor[at]
        slip = slip - np.einsum("mi,mi->m", slip, points.normal)[:, None] * points.normal
        size = np.linalg.norm(response.friction, axis=1)
        if patient:
            held = bonded | response.sticking
            stuck[at] = held | ~response.active
            friction[at] = (
                response.friction
                * np.minimum(1.0, np.divide(limit, size, out=np.ones(len(at)), where=~bonded & (size > 0.0)))[:, None]
            )
        else:
            loaded = pair.friction * np.maximum(memory.pressure[at], 0.0)
            stick, traction = response.sticking, response.friction
            torn = np.where(stick & ~bonded & known, np.maximum(size - loaded, 0.0), 0.0)
            if points.area @ torn > _TORN * (points.area @ loaded) > 0.0:
                pressure, limit = np.where(known, memory.pressure[at], 0.0), loaded
                stick = memory.stuck[at] & (memory.gripping[at] >= _GRIPS)
                traction = np.where(stick[:, None], memory.friction[at] - penalty[:, None] * slip, traction)
                size = np.linalg.norm(traction, axis=1)
            held = bonded | (stick & (size <= limit))
            against = np.einsum("mi,mi->m", slip, traction) < 0.0
            sliding = ~stick & against
            far = penalty * np.linalg.norm(slip, axis=1)
            turn = np.minimum(1.0, np.divide(far, limit, out=np.ones(len(at)), where=limit > 0.0))
            path = unit(traction)
            path = np.where(sliding[:, None], unit(path - turn[:, None] * unit(slip)), path)
            fresh = memory.gripping[at] < _GRIPS
            stuck[at] = held | (~stick & ~against) | fresh
            friction[at] = np.where(held[:, None], traction, limit[:, None] * path)
        friction[at] *= known[:, None]
    normal[at] = pressure
    gripping = np.where(normal > 0.0, memory.gripping + 1, 0).astype(np.int32)
    anchor = memory.anchor
    seizing = memory.apart[at] & (gripping[at] == _GRIPS) & (memory.gripping[at] < _GRIPS)
    if seizing.any() and pair.friction > 0.0:
        anchor = anchor.copy()
        anchor[at[seizing]] = whole[seizing]
    return replace(memory, pressure=normal, friction=friction, gripping=gripping, anchor=anchor, stuck=stuck)
