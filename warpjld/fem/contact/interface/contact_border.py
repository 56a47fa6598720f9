"""Where contact, or what sticks of it, ends inside a face.

Near the border of a smooth contact pressure goes to zero as p = P √s with the distance s inside it, and outside the
gap opens as g = (4 / 3) (P / E*) s^1.5 (Johnson 1985, §5.1: what Hertz's solution does, and any other). A node's
pressure is an average over the faces around it, with the node's hat function as its weight: of a border that lies
f edges beyond the node (within it, if negative) it is P √L φ(f), φ(f) = 4/15 ((f + 1)^2.5 − 2 f^2.5 + (f − 1)^2.5),
powers of what is negative left out. That, and the gap at the open end of the edge, say where the border is:
(1 − f)^1.5 = q φ(f), q = 3 E* g / (4 p L). Where gaps are averages too, of an end t edges outside, t^1.5 becomes
γ(t) = 2/3 t^1.5 + 1/6 ((t + 1)^1.5 + (t − 1)^1.5): a mesh's gap is right at nodes, and straight between them.

Inside contact, the area that friction holds ends alike: what is left of Coulomb's limit, μ p − |q|, goes to zero as √s
(Cattaneo, Mindlin; Johnson 1985, §7.2). Slip there depends on how the loads came, so that the scale is taken from the
next node inwards instead: of what is left at the two, the share is φ(f) / φ(f + 1).
"""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_points import Interface

__all__ = ["beyond", "contact_modulus", "held_beyond"]

_ROUNDS = 40


def contact_modulus(body: Body, interface: Interface) -> Array:
    """E* at small strain at an interface's slave nodes [Pa], 1 / E* = Σ (1 − ν²) / E over both sides, shape (m,)."""
    shear, bulk = 2.0 * body.constants[:, :2].sum(axis=1), body.constants[:, 2]
    young = 9.0 * bulk * shear / (3.0 * bulk + shear)
    compliance = (1.0 - (0.5 * young / shear - 1.0) ** 2) / young
    where, count = body.mesh.elements.ravel(), len(body.mesh.nodes)
    total = np.bincount(where, weights=np.repeat(compliance, 8), minlength=count)
    each = total / np.maximum(np.bincount(where, minlength=count), 1)
    own = each[interface.slave.nodes]
    other = float(np.median(each[interface.opposite])) if len(interface.opposite) else 0.0
    return np.asarray(1.0 / (own + other))


def beyond(pressure: Array, gap: Array, length: Array, modulus: Array, *, averaged: bool = False) -> Array:
    """By how many edges the border lies beyond a pressed node, towards an open one, −1 to 1.

    Args:
        pressure: At the pressed end [Pa], above 0.
        gap: At the open end [m]; infinite where nothing is opposite.
        length: Of the edges [m].
        modulus: E* [Pa].
        averaged: Whether gaps are averages over the faces around a node, as pressures are.
    """
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        q = 0.75 * modulus * np.maximum(gap, 0.0) / (pressure * length)
    q = np.clip(np.nan_to_num(q, nan=np.inf, posinf=1e100), 0.0, 1e100)
    low, high = np.full_like(q, -1.0), np.full_like(q, 2.0 if averaged else 1.0)
    for _ in range(_ROUNDS):
        f = 0.5 * (low + high)
        average = _averaged_pressure(f)
        outside = _averaged_gap(1.0 - f) if averaged else (1.0 - f) ** 1.5
        farther = outside > q * average
        low, high = np.where(farther, f, low), np.where(farther, high, f)
    return 0.5 * (low + high)


def held_beyond(spare: Array, inwards: Array) -> Array:
    """By how many edges the border of what sticks lies beyond a node, −1 to 1.

    Args:
        spare: What is left there of Coulomb's limit [Pa], above 0.
        inwards: The same an edge farther inside [Pa]; 0 where that is not known.
    """
    known = inwards > 0.0
    share = np.where(known, spare / np.where(known, inwards, 1.0), 0.0)
    low, high = np.full_like(share, -1.0), np.ones_like(share)
    for _ in range(_ROUNDS):
        f = 0.5 * (low + high)
        farther = _averaged_pressure(f) < share * _averaged_pressure(f + 1.0)
        low, high = np.where(farther, f, low), np.where(farther, high, f)
    return np.where(known, 0.5 * (low + high), 0.0)


def _averaged_pressure(f: Array) -> Array:
    """φ(f)."""
    outer, middle, inner = (np.maximum(f + k, 0.0) ** 2.5 for k in (1.0, 0.0, -1.0))
    return np.asarray((4.0 / 15.0) * (outer - 2.0 * middle + inner))


def _averaged_gap(t: Array) -> Array:
    """γ(t)."""
    outer, middle, inner = (np.maximum(t + k, 0.0) ** 1.5 for k in (1.0, 0.0, -1.0))
    return np.asarray((outer + 4.0 * middle + inner) / 6.0)
