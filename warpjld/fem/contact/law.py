"""Pressure and friction at contact points: augmented Lagrangian, Coulomb's cone, bonds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.pairs import Pair
from warpjld.fem.contact.points import ContactPoints

__all__ = ["Memory", "Response", "remember", "respond", "start_memory"]

_GRIPS = 2


@dataclass(frozen=True, eq=False)
class Memory:
    """What an interface knows of each of its s sites.

    Attributes:
        pressure: Multiplier along the normal [Pa], ≥ 0 unless bonded, shape (s,).
        friction: Multiplier across it, on the slave [Pa], shape (s, 3).
        allowance: Overlap that is still allowed, where the step began inside the other body [m], shape (s,) (R112).
        gripping: Iterations for which something has pressed; friction acts from the second, when the overlap of the
            first guess is gone, shape (s,).
        stuck: Whether friction holds it, or it slides if not, shape (s,).
        bonded: Whether the bond holds, shape (s,).
        seam: Gap at which the bond was made [m], shape (s,).
    """

    pressure: NDArray[np.float64]
    friction: NDArray[np.float64]
    allowance: NDArray[np.float64]
    gripping: NDArray[np.int32]
    stuck: NDArray[np.bool_]
    bonded: NDArray[np.bool_]
    seam: NDArray[np.float64]


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

    pressure: NDArray[np.float64]
    friction: NDArray[np.float64]
    active: NDArray[np.bool_]
    sticking: NDArray[np.bool_]
    error: NDArray[np.float64]
    blocks: NDArray[np.float64]

    def traction(self, points: ContactPoints) -> NDArray[np.float64]:
        """Force per area on the slave [Pa], shape (m, 3)."""
        return self.friction - self.pressure[:, None] * points.normal


def start_memory(count: int, pair: Pair) -> Memory:
    """Nothing touches yet; what is bonded is."""
    bonded = np.full(count, pair.bond is not None)
    return Memory(
        pressure=np.zeros(count),
        friction=np.zeros((count, 3)),
        allowance=np.zeros(count),
        gripping=np.zeros(count, np.int32),
        stuck=np.ones(count, dtype=bool),
        bonded=bonded,
        seam=np.full(count, np.nan),
    )


def respond(
    pair: Pair,
    points: ContactPoints,
    memory: Memory,
    slip: NDArray[np.float64],
    penalty: NDArray[np.float64],
    allowed: float,
    *,
    keep: bool = False,
) -> Response:
    """Tractions and stiffness at points, p = max(0, λ − ε g), friction returned to Coulomb's cone (R122).

    The stiffness is symmetric: that the friction of a sliding point depends on its pressure is left to the iteration.

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
        slip = np.einsum("mij,mj->mi", across, slip)
        carried = np.einsum("mij,mj->mi", across, memory.friction[at])
        # the pressure of the iterate before bounds the friction of this one: each iterate is then a convex problem
        bound = np.maximum(memory.pressure[at] if keep else pressure, 0.0)
        grips = active & ((memory.gripping[at] >= _GRIPS) | bonded)
        limit = np.where(grips, pair.friction * bound, 0.0)
        sticking = grips & (memory.stuck[at] | bonded)
        held = carried - penalty[:, None] * slip
        along = _unit(carried)
        friction = np.where(sticking[:, None], held, limit[:, None] * along)
        # a sliding point resists what would turn its path, as much as it slides
        turning = np.minimum(
            penalty, np.divide(limit, np.linalg.norm(slip, axis=1), out=penalty.copy(), where=slip.any(axis=1))
        )
        turning = np.where(limit > 0.0, turning, 0.0)
        beside = across - along[:, :, None] * along[:, None, :]
        tangent = np.where(sticking[:, None, None], penalty[:, None, None] * across, turning[:, None, None] * beside)
        blocks += np.where(grips, points.area, 0.0)[:, None, None] * tangent
    return Response(pressure, friction, active, sticking, error, blocks)


def remember(
    pair: Pair,
    memory: Memory,
    points: ContactPoints,
    response: Response,
    slip: NDArray[np.float64],
    known: NDArray[np.bool_],
) -> Memory:
    """Multipliers after a linear solve that foresees a response and a slip (m, 3), and who sticks from now on (R122).

    What stuck slides where its friction exceeds μ p; what slid sticks where friction would push it along its path. Of
    points that the solve did not know of (``known``, shape (m,)), nothing is remembered: penalty is not pressure.
    """
    at = points.sites
    count = len(memory.pressure)
    pressure, friction = np.zeros(count), np.zeros((count, 3))
    pressure[at] = np.where(known, response.pressure, 0.0)
    gripping = np.where(pressure > 0.0, memory.gripping + 1, 0).astype(np.int32)
    stuck = np.ones(count, dtype=bool)
    if pair.friction > 0.0 or memory.bonded.any():
        limit = pair.friction * np.maximum(pressure[at], 0.0)
        slip = slip - np.einsum("mi,mi->m", slip, points.normal)[:, None] * points.normal
        size = np.linalg.norm(response.friction, axis=1)
        bonded = memory.bonded[at]
        held = bonded | (response.sticking & (size <= limit))
        against = np.einsum("mi,mi->m", slip, response.friction) < 0.0
        sliding = ~response.sticking & against
        path = np.where(sliding[:, None], _unit(_unit(response.friction) - _unit(slip)), _unit(response.friction))
        fresh = memory.gripping[at] < _GRIPS
        stuck[at] = held | (~response.sticking & ~against) | fresh
        friction[at] = np.where(bonded[:, None] | held[:, None], response.friction, limit[:, None] * path)
        friction[at] *= known[:, None]
    return replace(memory, pressure=pressure, friction=friction, gripping=gripping, stuck=stuck)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)
