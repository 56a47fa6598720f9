"""Update of the multipliers, λ ← the tractions a linear solve foresees, and of who sticks (Simo & Laursen 1992)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array, Ints, Mask
from warpjld.fem.contact.interface.contact_points import ContactPoints, tangential
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.fem.contact.law.return_mapping import FRICTION_FROM, ContactTractions
from warpjld.geometry.rotations import unit

__all__ = ["update_multipliers"]

_TORN = 3.0
"""Friction in excess of Coulomb's, over Coulomb's, from which pressures found beside it say nothing."""


def update_multipliers(
    pair: Pair,
    state: ContactState,
    points: ContactPoints,
    tractions: ContactTractions,
    slip: Array,
    penalty: Array,
    known: Mask,
    decides: ActiveSet,
) -> ContactState:
    """State after a linear solve that foresees tractions and a slip (m, 3), and who sticks from now on (R122).

    Of points that the solve did not know of (``known``, shape (m,)), nothing is kept: penalty is not pressure.
    """
    at, count = points.sites, len(state.pressure)
    normal, friction = np.zeros(count), np.zeros((count, 3))
    sticking = np.ones(count, dtype=bool)
    pressure = np.where(known, tractions.pressure, 0.0)
    if pair.friction > 0.0 or state.bonded.any():
        across = tangential(slip - state.slip_anchor[at], points.normal)
        if decides is ActiveSet.TRIAL:
            friction[at], sticking[at] = _as_found(pair, state, at, tractions, pressure)
        else:
            pressure, friction[at], sticking[at] = _corrected(
                pair, state, points, tractions, pressure, across, penalty, known
            )
        friction[at] *= known[:, None]
    normal[at] = pressure
    pressed_for = np.where(normal > 0.0, state.pressed_for + 1, 0).astype(np.int32)
    anchor = state.slip_anchor
    seizing = (pressed_for[at] == FRICTION_FROM) & (state.pressed_for[at] < FRICTION_FROM) & state.open_before[at]
    if seizing.any() and pair.friction > 0.0:
        anchor = anchor.copy()
        anchor[at[seizing]] = state.touched_at[at[seizing], None] * slip[seizing]
    return replace(
        state, pressure=normal, friction=friction, pressed_for=pressed_for, slip_anchor=anchor, sticking=sticking
    )


def _as_found(
    pair: Pair, state: ContactState, at: Ints, tractions: ContactTractions, pressure: Array
) -> tuple[Array, Mask]:
    """Friction and who sticks as the return mapping has them, friction no more than μ p of the new pressure."""
    bonded = state.bonded[at]
    limit = pair.friction * np.maximum(pressure, 0.0)
    size = np.linalg.norm(tractions.friction, axis=1)
    share = np.minimum(1.0, np.divide(limit, size, out=np.ones(len(at)), where=~bonded & (size > 0.0)))
    return tractions.friction * share[:, None], bonded | tractions.sticking | ~tractions.active


def _corrected(
    pair: Pair,
    state: ContactState,
    points: ContactPoints,
    tractions: ContactTractions,
    pressure: Array,
    slip: Array,
    penalty: Array,
    known: Mask,
) -> tuple[Array, Array, Mask]:
    """Pressure, friction and who sticks in the fixed-point phase.

    What stuck slides where its friction exceeds μ p; what slid sticks where friction would push it along its path.
    Pressures under friction far beyond Coulomb's, of a step that slides a long way, are not kept: they would tear off
    what in truth lies still or slides.
    """
    at = points.sites
    bonded = state.bonded[at]
    limit = pair.friction * np.maximum(pressure, 0.0)
    size = np.linalg.norm(tractions.friction, axis=1)
    loaded = pair.friction * np.maximum(state.pressure[at], 0.0)
    stick, traction = tractions.sticking, tractions.friction
    torn = np.where(stick & ~bonded & known, np.maximum(size - loaded, 0.0), 0.0)
    if points.area @ torn > _TORN * (points.area @ loaded) > 0.0:
        pressure, limit = np.where(known, state.pressure[at], 0.0), loaded
        stick = state.sticking[at] & (state.pressed_for[at] >= FRICTION_FROM)
        traction = np.where(stick[:, None], state.friction[at] - penalty[:, None] * slip, traction)
        size = np.linalg.norm(traction, axis=1)
    held = bonded | (stick & (size <= limit))
    against = np.einsum("mi,mi->m", slip, traction) < 0.0
    far = penalty * np.linalg.norm(slip, axis=1)
    turn = np.minimum(1.0, np.divide(far, limit, out=np.ones(len(at)), where=limit > 0.0))
    path = unit(traction)
    path = np.where((~stick & against)[:, None], unit(path - turn[:, None] * unit(slip)), path)
    fresh = state.pressed_for[at] < FRICTION_FROM
    friction = np.where(held[:, None], traction, limit[:, None] * path)
    return pressure, friction, held | (~stick & ~against) | fresh
