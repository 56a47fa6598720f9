"""Contact states at the start of a run: bonds made, initial overlaps stored as allowance (R112)."""

from __future__ import annotations

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.law.contact_state import ContactState, initial_state

__all__ = ["first_state"]


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
