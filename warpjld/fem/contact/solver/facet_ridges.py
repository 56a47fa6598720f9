"""Scatter of the pressure on ridges between coarse facets that a finer surface presses against.

A curved body meshed with facets larger than the contact is a polyhedron to a finer slave, which presses on the ridges
between them. A ridge whose facets make an angle θ, pressed flat, has a mean pressure of E* θ / 4 (Sneddon 1948: E* tan
β / 2 with flanks at β = θ / 2), and about twice as much at the nodes on it. Between balls the worst error of a nodal
pressure was 1.1 times that, where the ridges lay inside the contact.
"""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.contact.interface.contact_interface import Interface
from warpjld.fem.contact.interface.surface import ContactSurface
from warpjld.fem.contact.results.contact_solution import PairContact
from warpjld.geometry.rotations import unit

__all__ = ["scatter_by_ridges"]

_FINER = 1.5
"""Ratio of the master's to the slave's edges from which the slave resolves ridges."""
_PEAK = 1.5
"""Peak over mean pressure of a smooth contact (Hertz)."""
_SHARP = np.radians(40.0)
"""Angle between two facets above which their edge is one of the body's, and not due to its mesh [rad]."""


def scatter_by_ridges(interface: Interface, modulus: Array, touch: PairContact, x: Array) -> float:
    """Estimated error of single pressures over the peak value, due to ridges between a coarse master's facets; 0 if the
    slave is not finer.

    Args:
        interface: Interface.
        modulus: E* at its slave nodes [Pa], shape (m,).
        touch: Its contact.
        x: Positions of the bodies' nodes [m], shape (N, 3).
    """
    if interface.mortar is None or not touch.contact_area > 0.0:
        return 0.0
    master = interface.mortar.master
    load = np.linalg.norm(touch.nodal[master.nodes], axis=1)
    mine = np.linalg.norm(touch.nodal[interface.slave.nodes], axis=1)
    if not (load.any() and mine.any()):
        return 0.0
    if np.average(master.edge, weights=load) < _FINER * np.average(interface.slave.edge, weights=mine):
        return 0.0
    turn = np.average(_ridges(master, x), weights=load)
    stiff = np.average(modulus, weights=mine)
    return float(0.5 * stiff * turn * touch.contact_area / (_PEAK * touch.normal_force))


def _ridges(surface: ContactSurface, x: Array) -> Array:
    """Mean angle between the facets that meet at edges of each node [rad], sharp edges left out, shape (m,)."""
    normal = unit(surface.area_vectors(x))
    start, end = surface.corners.ravel(), np.roll(surface.corners, -1, axis=1).ravel()
    face = np.repeat(np.arange(len(surface.corners)), 4)
    key = np.minimum(start, end).astype(np.int64) * len(surface.nodes) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    two = order[:-1][key[order[:-1]] == key[order[1:]]]
    other = order[1:][key[order[:-1]] == key[order[1:]]]
    turn = np.arccos(np.clip(np.einsum("ei,ei->e", normal[face[two]], normal[face[other]]), -1.0, 1.0))
    two, turn = two[turn < _SHARP], turn[turn < _SHARP]
    ends, twice = np.concatenate([start[two], end[two]]), np.concatenate([turn, turn])
    count = np.bincount(ends, minlength=len(surface.nodes))
    return np.asarray(np.bincount(ends, twice, len(surface.nodes)) / np.maximum(count, 1))
