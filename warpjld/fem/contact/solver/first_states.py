"""Contact states at the start of a run: bonds made, initial overlaps stored as allowance (R112); and of a step in which
contact alone holds a body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.law.contact_state import ContactState, initial_state

__all__ = ["farthest_carried", "first_state", "stuck_again"]


def first_state(interface: Interface, nodes: Array) -> ContactState:
    """Initial state of an interface between undeformed bodies with nodes [m], shape (N, 3).

    Raises:
        InputError: A bond whose two sides do not meet, or whose parted sites are of another surface.
    """
    state = initial_state(len(interface.edge), interface.pair)
    points = interface.points(nodes, 0.0, 0.0)
    if interface.pair.bond is not None:
        state.bond_gap[points.sites] = points.gap
        if len(points.sites) == 0:
            raise InputError(f"{interface.pair.title}: a bond to nothing: its two sides do not meet")
        if parted := interface.pair.bond.parted:
            if len(parted) != len(state.bonded):
                raise InputError(f"{interface.pair.title}: parted: want {len(state.bonded)} values, got {len(parted)}")
            state.bond_gap[np.array(parted)] = np.nan
        state.bonded[np.isnan(state.bond_gap)] = False
    else:
        state.allowance[points.sites] = np.maximum(-points.gap, 0.0)
    return state


def farthest_carried(interfaces: Sequence[Interface], x: Array, before: float, time: float) -> float:
    """Largest motion between two times of obstacles near positions x (N, 3) [m]."""
    found = (interface.points(x, before, time).carried for interface in interfaces if interface.mortar is None)
    return max((float(np.abs(carried).max(initial=0.0)) for carried in found), default=0.0)


def stuck_again(interfaces: Sequence[Interface], states: list[ContactState]) -> list[ContactState]:
    """States in which all points with pressure and friction stick, if all of them slid: an elastic predictor.

    For bodies that contact alone holds and that are let go, as nothing else would resist their first motion: a block
    that slid between two pads went half a millimetre in the first linear solve, and 24 more were in vain; with this
    there are three. Not where prescribed sides move on, as these drag the body along.
    """
    known = zip(interfaces, states, strict=True)
    rubs = [(s.pressure > 0.0) & (interface.pair.friction > 0.0) for interface, s in known]
    if any((s.sticking & rub).any() for s, rub in zip(states, rubs, strict=True)):
        return states
    return [replace(s, sticking=s.sticking | rub) for s, rub in zip(states, rubs, strict=True)]
