"""State of contact points between linear solves: multipliers, active set, slip anchors, bonds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.fem.contact.interface.pairs import Pair

__all__ = ["ActiveSet", "ContactState", "initial_state", "without_bonds"]


class ActiveSet(Enum):
    """Rule that decides which points are active, and which of them stick."""

    FROZEN = "active and sticking by the multipliers, whatever the gaps (primal-dual active set)"
    PREDICTED = "active by the trial pressures, sticking by the previous state"
    TRIAL = "active and sticking by the trial tractions"


@dataclass(frozen=True, eq=False)
class ContactState:
    """Multipliers and history variables of an interface's s sites, between linear solves.

    Attributes:
        pressure: Normal multiplier λ_n [Pa], ≥ 0 unless bonded, shape (s,).
        friction: Tangential multiplier λ_t, on the slave [Pa], shape (s, 3).
        allowance: Initial penetration that is still admissible [m], shape (s,) (R112).
        pressed_for: Successive iterations with pressure; friction acts from the second on, when the overlap of the
            initial guess is removed, shape (s,).
        open_before: Whether the sides were apart at the start of the step, shape (s,).
        slip_anchor: Slip at which frictional contact began, for sites that were apart at the start of the step [m],
            shape (s, 3); up to it they slid freely.
        touched_at: Fraction of the step after which such sites touch, shape (s,); 1 if not known.
        sticking: Whether a site sticks; it slides otherwise, shape (s,).
        bonded: Whether the bond holds, shape (s,).
        bond_gap: Gap at which the bond was made [m], shape (s,); NaN without.
        stiffening: Factor on the penalty, raised where multipliers converge slowly, shape (s,).
    """

    pressure: Array
    friction: Array
    allowance: Array
    pressed_for: Ints32
    open_before: Mask
    slip_anchor: Array
    touched_at: Array
    sticking: Mask
    bonded: Mask
    bond_gap: Array
    stiffening: Array


def initial_state(count: int, pair: Pair) -> ContactState:
    """State of ``count`` sites without contact; bonded if the pair has a bond."""
    return ContactState(
        pressure=np.zeros(count),
        friction=np.zeros((count, 3)),
        allowance=np.zeros(count),
        pressed_for=np.zeros(count, np.int32),
        open_before=np.zeros(count, dtype=bool),
        slip_anchor=np.zeros((count, 3)),
        touched_at=np.ones(count),
        sticking=np.ones(count, dtype=bool),
        bonded=np.full(count, pair.bond is not None),
        bond_gap=np.full(count, np.nan),
        stiffening=np.ones(count),
    )


def without_bonds(state: ContactState, broken: Mask) -> ContactState:
    """The state with bonds (s,) broken for good and their tension and shear removed (R102)."""
    pressure = np.where(broken, np.maximum(state.pressure, 0.0), state.pressure)
    friction = np.where(broken[:, None], 0.0, state.friction)
    return replace(state, bonded=state.bonded & ~broken, pressure=pressure, friction=friction)
