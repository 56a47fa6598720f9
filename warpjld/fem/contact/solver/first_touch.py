"""When in a load step what was apart comes to touch: from there on friction resists what it slides.

In a step in which a body comes down by w, of which a gap g is the first part, and is dragged along by s, it slides
freely by s g / w and with friction by the rest. How far it comes down if nothing is in its way is known of what is
prescribed; what loads press down is followed in steps so short that it hardly slides before it touches.
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
"""Edges that something may slide in the step in which it comes to touch, if it is not known when it does."""
_HALF, _FAR = 0.5, 0.25
"""Share of a step taken for one that is not known; used where a site is dragged by more edges than this, or else what
touches beside others takes hold at the end of the step: flesh that is pressed slips a little everywhere."""
_PAST = 1e-3
"""Share of a step by which it is cut behind the first touch: what touches then presses."""
_LAST = 1.0 - 1e-9
"""Latest share of a step that is known: 1 is not."""
_APPROACH = 1e-9
"""Way towards the other side that is none, over an edge."""


def touched_at(
    interfaces: Sequence[Interface],
    states: Sequence[ContactState],
    nodes: Array,
    u: Array,
    ahead: Array,
    step: LoadStep,
) -> list[ContactState]:
    """States that know when in a step each site comes to touch.

    Args:
        interfaces, states: What may touch, and what is known of it.
        nodes: Rest positions of the bodies' nodes [m], shape (N, 3).
        u: Displacement where the step begins [m], shape (3N,).
        ahead: Displacement at its end if nothing is in the way, likewise.
        step: The step.
    """
    way = (ahead - u).reshape(-1, 3)
    x = nodes + ahead.reshape(-1, 3)
    out = []
    for interface, state in zip(interfaces, states, strict=True):
        if interface.pair.friction > 0.0:
            points = interface.points(x, step.before, step.time)
            past = points.relative(way) - points.carried
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
    """Share of a step after which two sides with friction, apart when it begins, first touch; 1 where none do, or where
    they do not slide from there on. Arguments as in ``touched_at``, whose states these are.
    """
    way, x, least = (ahead - u).reshape(-1, 3), nodes + ahead.reshape(-1, 3), 1.0
    for interface, state in zip(interfaces, states, strict=True):
        if interface.pair.friction == 0.0 or (state.pressure > 0.0).any():
            continue
        points = interface.points(x, step.before, step.time)
        share, edge = state.touched_at[points.sites], interface.edge[points.sites]
        drag = np.linalg.norm(tangential(points.relative(way) - points.carried, points.normal), axis=1)
        slides = (1.0 - share) * drag > _SLID * edge
        least = min(least, float((share + _PAST)[slides & (share < 1.0)].min(initial=1.0)))
    return least


def slid_unheld(interfaces: Sequence[Interface], states: Sequence[ContactState], u: Array, found: Equilibrium) -> bool:
    """Whether something came to touch in a step, at a share of it that is not known, and has slid far by then.

    Args:
        interfaces: What may touch.
        states: What was known of it where the step began.
        u: Displacement there [m], shape (3N,).
        found: The equilibrium at its end.
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
