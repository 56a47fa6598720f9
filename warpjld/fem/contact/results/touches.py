"""Evaluation of a pair's contact at its slave nodes from its contact points."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Ints, Mask
from warpjld.fem.contact.interface.contact_area import ContactArea
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.contact_points import ContactPoints, tangential
from warpjld.fem.contact.law.return_mapping import ContactTractions
from warpjld.fem.contact.results.contact_solution import PairContact
from warpjld.fem.contact.results.nodal_contact import to_nodes
from warpjld.geometry.rotations import unit

__all__ = ["touch_of"]

_LEAST = 1e-6
"""Least reserve of a sticking node, relative to its Coulomb bound."""


def touch_of(
    interface: Interface,
    points: ContactPoints,
    tractions: ContactTractions,
    slip: Array,
    bonded: Mask,
    modulus: Array,
    x: Array,
) -> PairContact:
    """Contact of a pair at an instant, from its points (m) to its slave nodes (n).

    Values at a node are weighted averages over the points around it; between two meshes the multipliers themselves
    oscillate from node to node.

    Args:
        interface, points, tractions: The interface, its contact points, their tractions.
        slip: Relative displacement in the step [m], shape (m, 3).
        bonded: Mask of the sites whose bond holds.
        modulus: E* at all slave nodes [Pa], for the border of contact (see ``ContactArea``).
        x: Positions of the body's nodes [m], shape (N, 3).
    """
    share = points.weights[:, interface.slave.nodes].maximum(0.0)  # weights of the slave side
    weight = share.T.multiply(points.area).tocsr()
    area = np.asarray(weight.sum(axis=1)).ravel()
    near = np.flatnonzero(area > 0.0)
    area = area[near]
    mean = (weight[near] / area[:, None]).tocsr()
    traction = tractions.traction(points)
    normal = unit(mean @ points.normal)
    nodes = interface.slave.nodes[near]
    pressure, pushed = mean @ tractions.pressure, mean @ traction
    apart = _gaps(interface, points, near, mean)
    holds = mean @ bonded[points.sites].astype(float) > 0.0
    active = mean @ tractions.active.astype(float)
    sticking = mean @ (tractions.sticking & tractions.active).astype(float) > 0.5 * active
    friction = np.linalg.norm(tangential(pushed, normal), axis=1)
    limit = interface.pair.friction * pressure
    spare = np.where(sticking, np.maximum(limit - friction, _LEAST * limit), 0.0)
    inside = ContactArea(interface, near, area, x)
    pressed, held = inside.areas(pressure, mean @ points.gap if interface.averages else apart, modulus, spare)
    pressed, held = np.where(holds, area, pressed), np.where(holds, area, held)
    slipped = mean @ tangential(slip, points.normal)
    push = area * (mean @ np.maximum(tractions.pressure, 0.0))
    there = mean @ (-points.weights).maximum(0.0)
    return PairContact(
        name=interface.pair.label,
        nodes=nodes,
        position=x[nodes],
        normal=normal,
        pressure=pressure,
        traction=pushed,
        gap=apart,
        area=area,
        pressed=pressed,
        held=held,
        slip=slipped,
        sticking=sticking,
        bonded=holds,
        nodal=points.forces(traction),
        nodal_contact=to_nodes(nodes, push, pressed, held, slipped, there, len(x)),
    )


def _gaps(interface: Interface, points: ContactPoints, near: Ints, mean: Any) -> Array:
    """Gaps of slave nodes [m], shape (n,): their own between meshes, else the smallest of their points."""
    if len(near) == 0:
        return np.empty(0)
    least = np.minimum.reduceat(points.gap[mean.indices], mean.indptr[:-1])
    if len(interface.opposite):
        own = np.full(len(interface.slave.nodes), np.nan)
        own[points.sites] = points.gap
        least = np.where(np.isnan(own[near]), least, own[near])
    return np.asarray(least, np.float64)
