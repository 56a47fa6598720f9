"""Where contact ends inside a face: its border, and so its area, finer than the mesh.

Near the border of a smooth contact pressure goes to zero as p = P √s with the distance s inside it, and outside the
gap opens as g = (4 / 3) (P / E*) s^1.5 (Johnson 1985, §5.1: what Hertz's solution does, and any other). A node's
pressure is an average over the faces around it, with the node's hat function as its weight: of a border that lies
f edges beyond the node (within it, if negative) it is P √L φ(f), φ(f) = 4/15 ((f + 1)^2.5 − 2 f^2.5 + (f − 1)^2.5),
powers of what is negative left out. That, and the gap at the open end of the edge, say where the border is:
(1 − f)^1.5 = q φ(f), q = 3 E* g / (4 p L). Where gaps are such averages too, of an end t edges outside, t^1.5 becomes
γ(t) = 4/35 ((t + 1)^3.5 − 2 t^3.5 + (t − 1)^3.5).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.body import Body
from warpjld.fem.contact.points import Interface

__all__ = ["beyond", "contact_modulus", "pressed_at_nodes"]

_ROUNDS = 40


def contact_modulus(body: Body, interface: Interface) -> NDArray[np.float64]:
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


def beyond(
    pressure: NDArray[np.float64],
    gap: NDArray[np.float64],
    length: NDArray[np.float64],
    modulus: NDArray[np.float64],
    *,
    averaged: bool = False,
) -> NDArray[np.float64]:
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
        average = (4.0 / 15.0) * ((f + 1.0) ** 2.5 - 2.0 * np.maximum(f, 0.0) ** 2.5 + np.maximum(f - 1.0, 0.0) ** 2.5)
        outside = _averaged_gap(1.0 - f) if averaged else (1.0 - f) ** 1.5
        farther = outside > q * average
        low, high = np.where(farther, f, low), np.where(farther, high, f)
    return 0.5 * (low + high)


def _averaged_gap(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(
        (4.0 / 35.0) * ((t + 1.0) ** 3.5 - 2.0 * np.maximum(t, 0.0) ** 3.5 + np.maximum(t - 1.0, 0.0) ** 3.5)
    )


def pressed_at_nodes(
    interface: Interface,
    near: NDArray[np.int64],
    pressure: NDArray[np.float64],
    gap: NDArray[np.float64],
    area: NDArray[np.float64],
    modulus: NDArray[np.float64],
    x: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Area under pressure around slave nodes [m²], shape (n,): each face's share inside the border goes to its pressed
    corners, as far as their surroundings have something opposite.

    Args:
        interface: The pair.
        near: Slave nodes with something before them, as indices into the surface's, shape (n,).
        pressure: [Pa], shape (n,).
        gap: At the nodes, or averaged around them where the interface averages [m], shape (n,).
        area: What has something opposite [m²], shape (n,).
        modulus: E* of all slave nodes [Pa], shape (m,).
        x: Positions of the body's nodes [m], shape (N, 3).
    """
    surface = interface.slave
    count = len(surface.nodes)
    whole = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))
    covered, load, distance = np.zeros(count), np.zeros(count), np.full(count, np.inf)
    covered[near] = np.minimum(area / np.maximum(whole[near], 1e-300), 1.0)
    load[near], distance[near] = pressure, gap
    pressed = load > 0.0
    around = np.zeros(count, dtype=bool)
    around[surface.corners[pressed[surface.corners].any(axis=1)]] = True
    some = np.flatnonzero(around[surface.corners].any(axis=1))
    corners = surface.corners[some]
    at = x[surface.quads[some]]
    depth = _depth(corners, at, load, distance, modulus, averaged=interface.averages)
    faces = _positive_area(at, depth[corners])
    mask = (pressed | (depth > 0.0))[corners]
    share = (faces / np.maximum(mask.sum(axis=1), 1))[:, None] * mask * covered[corners]
    return np.asarray(np.bincount(corners.ravel(), share.ravel(), minlength=count)[near])


def _depth(
    corners: NDArray[np.int32],
    at: NDArray[np.float64],
    load: NDArray[np.float64],
    gap: NDArray[np.float64],
    modulus: NDArray[np.float64],
    *,
    averaged: bool,
) -> NDArray[np.float64]:
    """How many edges nodes lie inside the border, negative outside, shape (m,)."""
    count = len(load)
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    length = np.linalg.norm(np.roll(at, -1, axis=1) - at, axis=2).ravel()
    start, end, length = np.concatenate([start, end]), np.concatenate([end, start]), np.tile(length, 2)
    pressed = load > 0.0
    out = np.where(pressed, 1.0, -1.0)
    crossing = pressed[start] & ~pressed[end]
    i, j = start[crossing], end[crossing]
    f = beyond(load[i], gap[j], np.maximum(length[crossing], 1e-300), modulus[i], averaged=averaged)
    alone = np.ones(count, dtype=bool)
    alone[start[pressed[start] & pressed[end]]] = False
    f = np.where(alone[i], np.maximum(f, 0.0), f)  # something presses there
    for nodes, values in ((i, f), (j, f - 1.0)):
        total, number = np.bincount(nodes, values, count), np.bincount(nodes, minlength=count)
        out = np.where(number > 0, total / np.maximum(number, 1), out)
    rim = np.zeros(count, dtype=bool)
    rim[i] = True
    inner = pressed[start] & ~rim[start] & rim[end]
    least = np.full(count, np.inf)
    np.minimum.at(least, start[inner], out[end[inner]] + 1.0)
    out = np.where(np.isfinite(least), least, out)
    edge = np.zeros(count, dtype=bool)
    edge[j] = True
    outer = ~pressed[start] & ~edge[start] & edge[end]
    most = np.full(count, -np.inf)
    np.maximum.at(most, start[outer], out[end[outer]] - 1.0)
    return np.where(np.isfinite(most), np.minimum(most, 0.0), out)


def _positive_area(at: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of the part of quadrilaterals (F, 4, 3) where what their corners say (F, 4) is positive, shape (F,)."""
    polygon = np.zeros((len(at), 8, 3))
    used = np.zeros((len(at), 8), dtype=bool)
    for k in range(4):
        here, there = values[:, k], values[:, (k + 1) % 4]
        used[:, 2 * k] = here > 0.0
        used[:, 2 * k + 1] = (here > 0.0) != (there > 0.0)
        way = here / np.where(used[:, 2 * k + 1], here - there, 1.0)
        polygon[:, 2 * k] = at[:, k]
        polygon[:, 2 * k + 1] = at[:, k] + way[:, None] * (at[:, (k + 1) % 4] - at[:, k])
    for k in range(16):  # what is not part of the polygon lies on the part before it
        polygon[:, k % 8] = np.where(used[:, k % 8, None], polygon[:, k % 8], polygon[:, (k - 1) % 8])
    from_first = polygon - polygon[:, :1]
    vector = 0.5 * np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1)
    return np.where(used.any(axis=1), np.linalg.norm(vector, axis=1), 0.0)
