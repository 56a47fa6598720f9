"""Multiplier update: λ ← tractions predicted by a linear solve, and update of the stick state (Simo & Laursen 1992)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array, Ints, Mask
from warpjld.fem.contact.interface.contact_points import ContactPoints, tangential
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.law.contact_state import ActiveSet, ContactState
from warpjld.fem.contact.law.return_mapping import FRICTION_FROM, ContactTractions
from warpjld.geometry.rotations import unit

__all__ = ["elastic_multipliers", "update_multipliers"]

_TORN = 3.0
"""Friction in excess of Coulomb's bound, over that bound, above which the pressures of the same solve are discarded."""
_SHEARED = 200.0
"""Penalty times slip, over μ p, above which a point slides when friction begins to act. As ε is 200 E*/edge, elements
sheared by that slip would bear about E* slip/edge > μ p. With 1 instead of 200, a hand closed on a ball with a fifth
more linear solves, and on a box and a can with as many."""


def update_multipliers(
    pair: Pair,
    state: ContactState,
    points: ContactPoints,
    tractions: ContactTractions,
    slip: Array,
    penalty: Array,
    known: Mask,
    decides: ActiveSet,
    *,
    slides: bool = False,
) -> ContactState:
    """State after a linear solve that predicts tractions and a slip (m, 3) (R122).

    Args:
        pair: Friction and bond.
        state: State before.
        points: Contact points.
        tractions: Predicted tractions.
        slip: Predicted slip [m], shape (m, 3).
        penalty: ε [Pa/m], shape (m,).
        known: Mask of points that were active in the solve, shape (m,); others get no multiplier, since a penalty
            traction is no converged pressure.
        decides: Rule for the active set.
        slides: Whether friction begins to act against the slip found without it (``_sliding_first``).
    """
    at, count = points.sites, len(state.pressure)
    normal, friction = np.zeros(count), np.zeros((count, 3))
    sticking = np.ones(count, dtype=bool)
    pressure = np.where(known, tractions.pressure, 0.0)
    if pair.friction > 0.0 or state.bonded.any():
        across = tangential(slip - state.slip_anchor[at], points.normal)
        if decides is ActiveSet.TRIAL:
            friction[at], sticking[at] = _by_return_mapping(pair, state, at, tractions, pressure)
        else:
            pressure, friction[at], sticking[at] = _corrected(
                pair, state, points, tractions, pressure, across, penalty, known
            )
            if slides:
                friction[at], sticking[at] = _sliding_first(
                    pair, state, points, pressure, friction[at], sticking[at], slip, penalty
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


def elastic_multipliers(pair: Pair, before: ContactState, state: ContactState, *, ended: bool) -> ContactState:
    """The state after an update, without multipliers if the pair is elastic.

    Its tractions are those of the penalty alone; the shear of a bond is that at the end of the last step, plus the
    penalty's. ``ended`` is the end of a step.
    """
    if not pair.elastic:
        return state
    shear = np.where(state.bonded[:, None], state.friction if ended else before.friction, 0.0)
    return replace(state, pressure=np.zeros_like(state.pressure), friction=shear)


def _by_return_mapping(
    pair: Pair, state: ContactState, at: Ints, tractions: ContactTractions, pressure: Array
) -> tuple[Array, Mask]:
    """Friction and stick state of the return mapping, with friction limited to μ p of the new pressure."""
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
    """Pressure, friction and stick state in the fixed-point phase.

    A sticking point slides if its friction exceeds μ p; a sliding point sticks if friction would act along its slip.
    Pressures found together with friction far beyond Coulomb's bound, in a step with much sliding, are discarded: they
    would open contacts that in fact stick or slide.
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


def _sliding_first(
    pair: Pair,
    state: ContactState,
    points: ContactPoints,
    pressure: Array,
    friction: Array,
    sticking: Mask,
    moved: Array,
    penalty: Array,
) -> tuple[Array, Mask]:
    """Friction and stick state where friction begins to act after slips ``moved`` (m, 3) without it.

    A point slides, with μ p against its slip, if the body could not have borne that slip by sticking (``_SHEARED``);
    it sticks later if friction moves it the other way. If all points began by sticking, the load would be borne by
    those nearest to where it acts, and sliding would spread by one row of points in each linear solve (a belt halfway
    around a cylinder: 15 rows).
    """
    at, limit = points.sites, pair.friction * np.maximum(pressure, 0.0)
    touching = np.where(state.open_before[at], 1.0 - state.touched_at[at], 1.0)
    slip = tangential(touching[:, None] * moved, points.normal)
    begins = (state.pressed_for[at] == FRICTION_FROM - 1) & (limit > 0.0) & ~state.bonded[at]
    slides = begins & (penalty * np.linalg.norm(slip, axis=1) > _SHEARED * limit)
    return np.where(slides[:, None], -limit[:, None] * unit(slip), friction), sticking & ~slides
