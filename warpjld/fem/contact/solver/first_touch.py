"""Time of first contact within a load step, from which on friction resists sliding.

If a body approaches by w in a step, of which the gap g is the first part, and moves tangentially by s, it slides freely
by s g / w and with friction for the rest. The approach of bodies with prescribed motion is known in advance; for bodies
moved by loads, steps are made so short that they hardly slide before they touch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import tangential
from warpjld.fem.contact.law.contact_state import ContactState
from warpjld.fem.contact.solver.contact_system import LoadStep
from warpjld.fem.contact.solver.newton_state import Equilibrium

__all__ = ["first_touch", "slid_unheld", "touched_at"]

_SLID = 0.02
"""Largest tangential motion, in element edges, in a step in which contact begins at an unknown time."""
_HALF, _FAR = 0.5, 0.25
"""Fraction of the step assumed for an unknown time of first contact on an interface that is in contact already, for
sites that move tangentially by more than the second number of edges; other sites stick from the end of the step on, as
pressed flesh slips a little everywhere."""
_PAST = 1e-3
"""Fraction of a step by which it extends beyond the first contact when cut, so that there is pressure."""
_LAST = 1.0 - 1e-9
"""Largest known fraction; 1 means unknown."""
_APPROACH = 1e-9
"""Approach, in element edges, below which two sides count as not approaching."""


def touched_at(
    interfaces: Sequence[Interface],
    states: Sequence[ContactState],
    nodes: Array,
    u: Array,
    ahead: Array,
    step: LoadStep,
) -> list[ContactState]:
    """Contact states with ``touched_at`` set: the fraction of the step after which each site touches.

    Args:
        interfaces: Contact interfaces.
        states: Their states.
        nodes: Rest positions of the bodies' nodes [m], shape (N, 3).
        u: Displacement at the start of the step [m], shape (3N,).
        ahead: Predicted displacement at its end without contact [m], shape (3N,).
        step: The load step.
    """
    move = (ahead - u).reshape(-1, 3)
    x = nodes + ahead.reshape(-1, 3)
    out = []
    for interface, state in zip(interfaces, states, strict=True):
        if interface.pair.friction > 0.0:
            points = interface.points(x, step.before, step.time)
            past = points.relative(move) - points.carried
            towards = np.einsum("mi,mi->m", points.normal, past)
            edge, began = interface.edge[points.sites], bool((state.pressure > 0.0).any())
            known = towards > _APPROACH * edge
            behind = np.minimum(points.gap, 0.0) / np.where(known, towards, 1.0)
            found = np.where(known, np.clip(1.0 + behind, 0.0, _LAST), _HALF if began else 1.0)
            if began:
                drag = np.linalg.norm(tangential(past, points.normal), axis=1)
                found = np.where((1.0 - found) * drag > _FAR * edge, found, 1.0)
            share = np.ones(len(state.touched_at))
            share[points.sites] = found
            state = replace(state, touched_at=share)
        out.append(state)
    return out


def first_touch(
    interfaces: Sequence[Interface],
    states: Sequence[ContactState],
    nodes: Array,
    u: Array,
    ahead: Array,
    step: LoadStep,
) -> float:
    """Fraction of a step after which two separate sides with friction first touch and then slide; 1 if there are none.

    Arguments as in ``touched_at``, with the states that it returned.
    """
    move, x, least = (ahead - u).reshape(-1, 3), nodes + ahead.reshape(-1, 3), 1.0
    for interface, state in zip(interfaces, states, strict=True):
        if interface.pair.friction == 0.0 or (state.pressure > 0.0).any():
            continue
        points = interface.points(x, step.before, step.time)
        share, edge = state.touched_at[points.sites], interface.edge[points.sites]
        drag = np.linalg.norm(tangential(points.relative(move) - points.carried, points.normal), axis=1)
        slides = (1.0 - share) * drag > _SLID * edge
        least = min(least, float((share + _PAST)[slides & (share < 1.0)].min(initial=1.0)))
    return least


def slid_unheld(interfaces: Sequence[Interface], states: Sequence[ContactState], u: Array, found: Equilibrium) -> bool:
    """Whether contact began in a step at an unknown time with a large tangential motion.

    Args:
        interfaces: Contact interfaces.
        states: Their states at the start of the step.
        u: Displacement there [m], shape (3N,).
        found: Equilibrium at the end of the step.
    """
    moved = (found.displacement - u).reshape(-1, 3)
    for interface, state, points, tractions in zip(interfaces, states, found.points, found.tractions, strict=True):
        at = points.sites
        if interface.pair.friction == 0.0 or (state.pressure > 0.0).any():
            continue
        unknown = tractions.active & (state.touched_at[at] == 1.0)
        slid = np.linalg.norm(tangential(points.relative(moved) - points.carried, points.normal), axis=1)
        if (slid[unknown] > _SLID * interface.edge[at[unknown]]).any():
            return True
    return False
