"""Return mapping: trial tractions at contact points projected onto the Coulomb cone (R122).

Pressure is p = max(0, λ_n − ε g), except for bonds. Friction is the trial traction q = λ_t − ε s if |q| ≤ μ p (stick),
else μ p q / |q| (slip): Alart & Curnier 1991; Simo & Laursen 1992, Comput. Struct. 42.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.fem.arrays import Array, Mask
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.geometry.rotations import unit

__all__ = ["FRICTION_FROM", "ContactTractions", "overstrained", "return_mapping", "same_active_set"]

FRICTION_FROM = 2
"""Iterations with pressure after which friction acts."""


@dataclass(frozen=True, eq=False)
class ContactTractions:
    """Tractions and symmetric tangent of one interface's points.

    Attributes:
        pressure: p [Pa], shape (m,).
        friction: Tangential traction q on the slave [Pa], shape (m, 3).
        active: Whether the point is in contact or bonded, shape (m,).
        sticking: Whether the point sticks or is bonded, shape (m,).
        error: Penetration, or gap under pressure, that the multipliers still have to remove [m], shape (m,).
        blocks: A H of each point [N/m], shape (m, 3, 3).
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


def return_mapping(
    pair: Pair,
    points: ContactPoints,
    state: ContactState,
    slip: Array,
    penalty: Array,
    allowed: float,
    decides: ActiveSet,
    *,
    coupled: bool = False,
) -> ContactTractions:
    """Tractions at points and their symmetric tangent.

    The dependence of friction on pressure at sliding points is not in the tangent; it is left to the iteration, or to
    ``friction_coupling``.

    Args:
        pair: Friction and bond.
        points: Contact points.
        state: Multipliers and history variables.
        slip: Relative displacement of the two sides since the start of the step [m], shape (m, 3).
        penalty: ε [Pa/m], shape (m,).
        allowed: Fraction of the state's allowance that still counts, 0 to 1.
        decides: Rule for the active set. ``FROZEN``: points with a positive multiplier are active whatever their gap,
            possibly in tension for the moment; the linear solve decides whether they open, and not the second-order
            error of the last move, which the penalty would amplify. ``TRIAL``: tractions are continuous, and with fixed
            multipliers the problem is convex, so that a line search settles it.
        coupled: Whether friction is bounded by the current pressure instead of the multiplier.
    """
    at, normal = points.sites, points.normal
    bonded = state.bonded[at]
    made = np.nan_to_num(state.bond_gap[at])
    gap = np.where(bonded, points.gap - made, points.gap + allowed * state.allowance[at])
    pressure = state.pressure[at] - penalty * gap
    active = bonded | (pressure > 0.0)
    if decides is ActiveSet.FROZEN:
        active |= state.pressure[at] > 0.0
    pressure = np.where(active, pressure, 0.0)
    error = np.where(active, np.minimum(np.abs(gap), np.where(bonded, np.inf, np.maximum(-gap, pressure / penalty))), 0)
    outer = normal[:, :, None] * normal[:, None, :]
    blocks = np.zeros((len(at), 3, 3))
    blocks += np.where(active, points.area * penalty, 0.0)[:, None, None] * outer
    if not (pair.friction > 0.0 or bonded.any()):
        return ContactTractions(pressure, np.zeros((len(at), 3)), active, bonded.copy(), error, blocks)
    across = np.eye(3) - outer
    # Tresca friction: bounded by the previous iterate's pressure, so that each solve is a convex problem
    before = decides is not ActiveSet.PREDICTED and not coupled
    bound = np.maximum(state.pressure[at] if before else pressure, 0.0)
    grips = active & ((state.pressed_for[at] >= FRICTION_FROM) | bonded)
    limit = np.where(grips, pair.friction * bound, 0.0)
    trial = decides is ActiveSet.TRIAL or pair.elastic
    friction, sticking, tangent = _friction(state, points, across, slip, penalty, grips, limit, trial=trial)
    blocks += np.where(grips, points.area, 0.0)[:, None, None] * tangent
    return ContactTractions(pressure, friction, active, sticking, error, blocks)


def _friction(
    state: ContactState,
    points: ContactPoints,
    across: Array,
    slip: Array,
    penalty: Array,
    grips: Mask,
    limit: Array,
    *,
    trial: bool,
) -> tuple[Array, Mask, Array]:
    """Friction [Pa] (m, 3), stick state (m,), and the negative derivative of friction by slip [Pa/m] (m, 3, 3).

    ``trial``: points stick or slide by the trial tractions, not by the previous state.
    """
    at = points.sites
    slip = np.einsum("mij,mj->mi", across, slip - state.slip_anchor[at])
    carried = np.einsum("mij,mj->mi", across, state.friction[at])
    traction = carried - penalty[:, None] * slip
    if trial:
        size = np.linalg.norm(traction, axis=1)
        sticking = grips & ((size <= limit) | state.bonded[at])
        along = unit(traction)
        turning = penalty * np.divide(limit, size, out=np.zeros(len(at)), where=size > 0.0)
    else:
        sticking = grips & (state.sticking[at] | state.bonded[at])
        along = unit(carried)
        # stiffness against turning of the slip direction, inversely proportional to the slip
        far = np.linalg.norm(slip, axis=1)
        turning = np.minimum(penalty, np.divide(limit, far, out=penalty.copy(), where=far > 0.0))
    friction = np.where(sticking[:, None], traction, limit[:, None] * along)
    turning = np.where(limit > 0.0, turning, 0.0)
    beside = across - along[:, :, None] * along[:, None, :]
    tangent = np.where(sticking[:, None, None], penalty[:, None, None] * across, turning[:, None, None] * beside)
    return friction, sticking, tangent


def overstrained(pair: Pair, state: ContactState, points: ContactPoints, tractions: ContactTractions) -> Mask:
    """Mask of the sites whose bond's strength is exceeded, shape (s,) (R102)."""
    out = np.zeros(len(state.bonded), dtype=bool)
    if pair.bond is not None:
        pull = -tractions.pressure > pair.bond.normal
        shear = np.linalg.norm(tractions.friction, axis=1) > pair.bond.shear
        out[points.sites] = (pull | shear) & state.bonded[points.sites]
    return out


def same_active_set(tractions: list[ContactTractions], others: list[ContactTractions]) -> bool:
    """Whether the same points are active, and sticking, in both."""
    return all(
        np.array_equal(t.active, o.active) and np.array_equal(t.sticking, o.sticking)
        for t, o in zip(tractions, others, strict=True)
    )
