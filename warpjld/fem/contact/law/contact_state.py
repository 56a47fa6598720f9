"""State of contact points between linear solves: multipliers, active set, slip anchors, bonds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from warpjld.fem.arrays import Array, Ints32, Mask
from warpjld.fem.contact.interface.pairs import Pair

__all__ = ["ActiveSet", "ContactState", "initial_state", "without_bonds"]


class ActiveSet(Enum):
    """What decides which points press, and which of them stick."""

    FROZEN = "the multipliers decide both, whatever the gaps (primal-dual active set)"
    PREDICTED = "trial pressures decide who presses, the state before who sticks"
    TRIAL = "trial tractions decide both"


@dataclass(frozen=True, eq=False)
class ContactState:
    """What is known of each of an interface's s sites from one linear solve to the next.

    Attributes:
        pressure: Normal multiplier λ_n [Pa], ≥ 0 unless bonded, shape (s,).
        friction: Tangential multiplier λ_t, on the slave [Pa], shape (s, 3).
        allowance: Overlap that is still allowed, where the step began inside the other body [m], shape (s,) (R112).
        pressed_for: Iterations for which something has pressed; friction acts from the second, when the overlap of the
            first guess is gone, shape (s,).
        open_before: Whether the sides were apart when the step began, shape (s,).
        slip_anchor: Slip at which friction took hold of what was apart when the step began [m], shape (s, 3): on its
            way there it slid freely.
        touched_at: Share of the step after which what was apart when it began comes to touch, shape (s,).
        sticking: Whether friction holds it, or it slides if not, shape (s,).
        bonded: Whether the bond holds, shape (s,).
        bond_gap: Gap at which the bond was made [m], shape (s,).
        stiffening: Penalty over the usual one: more where a multiplier does not find its value soon, shape (s,).
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
    """Nothing touches yet; what is bonded is."""
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
    """With bonds (s,) broken for good, and no pull across them (R102)."""
    pressure = np.where(broken, np.maximum(state.pressure, 0.0), state.pressure)
    friction = np.where(broken[:, None], 0.0, state.friction)
    return replace(state, bonded=state.bonded & ~broken, pressure=pressure, friction=friction)
