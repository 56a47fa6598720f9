"""Bonds that part where the traction across them is too much, and for good (R102)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpjld.fem.arrays import Mask
from warpjld.fem.contact.interface.contact_points import Interface
from warpjld.fem.contact.law.law import ContactState
from warpjld.fem.contact.solver.newton_state import Reached

__all__ = ["overstrained", "released"]


def overstrained(k: int, interface: Interface, found: Reached) -> Mask:
    """Nodes whose bond does not hold, shape (m,)."""
    memory, points, response = found.memory[k], found.points[k], found.responses[k]
    out = np.zeros(len(memory.bonded), dtype=bool)
    bond = interface.pair.bond
    if bond is not None:
        pull = -response.pressure > bond.normal
        shear = np.linalg.norm(response.friction, axis=1) > bond.shear
        out[points.sites] = (pull | shear) & memory.bonded[points.sites]
    return out


def released(memory: ContactState, broken: Mask) -> ContactState:
    """No pull across what has parted."""
    pressure = np.where(broken, np.maximum(memory.pressure, 0.0), memory.pressure)
    friction = np.where(broken[:, None], 0.0, memory.friction)
    return replace(memory, pressure=pressure, friction=friction)
