"""Contact and stick areas with sub-element resolution: the borders inside faces, from asymptotics of the pressure.

At the border of a smooth contact, pressure vanishes as p = P √s with the distance s inside it, and outside the gap
opens as g = (4 / 3) (P / E*) s^1.5 (Johnson 1985, §5.1; as in Hertz's solution). A node's pressure is an average
weighted by its hat function: with the border f edges of length L beyond the node (before it if negative) it is P √L
φ(f), φ(f) = 4/15 ((f + 1)^2.5 − 2 f^2.5 + (f − 1)^2.5), with powers of negative numbers taken as 0. With the gap at the
open end of the edge, the border follows from (1 − f)^1.5 = q φ(f), q = 3 E* g / (4 p L). If gaps are averages too,
t^1.5 at an end t edges outside becomes γ(t) = 2/3 t^1.5 + 1/6 ((t + 1)^1.5 + (t − 1)^1.5): a mesh's gap is right at
nodes, and linear between them.

The border of the stick area is found alike: the reserve of friction, μ p − |q|, vanishes as √s there (Cattaneo,
Mindlin; Johnson 1985, §7.2). As slip depends on the load history, the scale is taken from the next node inwards: the
ratio of the two reserves is φ(f) / φ(f + 1).

A corner or an edge is in contact over a smaller area than that of its faces. For a cone or wedge whose flanks make an
angle β with the other surface, the mean pressure is E* tan β / 2, independent of the force (Sneddon 1948; Johnson 1985,
§5.2); the area is the force over this pressure.
"""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.body import Body
from warpjld.fem.contact.interface.contact_interface import Interface

__all__ = ["ContactArea", "beyond", "contact_modulus", "held_beyond"]

_ROUNDS = 40
"""Bisections for the position of a border."""
_POINT = 1e-3
"""Contact area of a pressed node, relative to its tributary area, below which it is taken as that of a cone's tip."""
_STEEPEST = 0.95
"""Largest slope (rise over length) of such a flank."""


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
    """Position f of the contact border on edges from a node in contact to an open one, in edge lengths, −1 to 1.

    Args:
        pressure: Pressure at the node in contact [Pa], above 0.
        gap: Gap at the open node [m]; infinite if nothing is opposite.
        length: Lengths of the edges [m].
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
    """Position f of the stick border beyond a sticking node, in edge lengths, −1 to 1.

    Args:
        spare: Reserve of friction μ p − |q| at the node [Pa], above 0.
        inwards: Reserve one edge farther inwards [Pa]; 0 if not known.
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


class ContactArea:
    """Evaluation of contact and stick areas on a slave surface.

    Args:
        interface: The interface.
        near: Slave nodes within the search distance, as indices into the surface's nodes, shape (n,).
        area: Parts of their tributary areas that face the other side [m²], shape (n,).
        x: Positions of the body's nodes [m], shape (N, 3).
    """

    def __init__(self, interface: Interface, near: Ints, area: Array, x: Array) -> None:
        surface = interface.slave
        self._interface, self._near, self._x = interface, near, x
        self._count = len(surface.nodes)
        whole = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))
        self._area = area
        self._covered = np.zeros(self._count)
        self._covered[near] = np.minimum(area / np.maximum(whole[near], 1e-300), 1.0)

    def areas(self, pressure: Array, gap: Array, modulus: Array, spare: Array) -> tuple[Array, Array]:
        """Contact area and stick area at nodes [m²], shape (n,) each.

        The part of each face inside the border is divided among its corners in contact, in proportion to the share of
        their tributary areas that faces the other side.

        Args:
            pressure: [Pa], shape (n,).
            gap: Gaps at the nodes, averaged if the interface averages [m], shape (n,).
            modulus: E* at all slave nodes [Pa], shape (m,).
            spare: Reserve of friction at sticking nodes [Pa], shape (n,); 0 where they slide.
        """
        near, count = self._near, self._count
        load, distance, left = np.zeros(count), np.full(count, np.inf), np.zeros(count)
        load[near], distance[near], left[near] = pressure, gap, spare
        pressed = load > 0.0
        corners = self._interface.slave.corners
        around = np.zeros(count, dtype=bool)
        around[corners[pressed[corners].any(axis=1)]] = True
        near_contact = np.flatnonzero(around[corners].any(axis=1))
        faces = _Faces(corners[near_contact], self._x[self._interface.slave.quads[near_contact]], count)
        i, j, length = faces.across(pressed)
        f = beyond(load[i], distance[j], length, modulus[i], averaged=self._interface.averages)
        depth = faces.depth(pressed, i, j, f)
        whole = self._at_nodes(faces, depth, pressed)
        whole = np.maximum(whole, self._tips(whole, pressure, modulus, _slopes(i, distance[j] / length, count)))
        stuck = (left > 0.0) & pressed
        if not stuck.any():
            return whole, np.zeros(len(near))
        i, j, _ = faces.across(stuck)
        inner = pressed[j]  # elsewhere the stick area ends at the border of contact
        i, j = i[inner], j[inner]
        held = faces.depth(stuck, i, j, held_beyond(left[i], faces.inwards(left, stuck, i, j)))
        held = np.where(pressed, np.minimum(depth, held), depth)
        return whole, np.minimum(self._at_nodes(faces, held, pressed), whole)

    def _tips(self, whole: Array, pressure: Array, modulus: Array, slope: Array) -> Array:
        """Area of contact as of a cone or wedge, where interpolation gives hardly any [m²], shape (n,); else 0."""
        near, area = self._near, self._area
        tip = (pressure > 0.0) & (whole < _POINT * area) & (slope[near] > 0.0)
        mean = 0.5 * modulus[near] * np.where(tip, slope[near], 1.0)
        return np.where(tip, area * np.minimum(pressure / mean, 1.0), 0.0)

    def _at_nodes(self, faces: _Faces, depth: Array, pressed: Mask) -> Array:
        """Area with positive ``depth`` (m,), divided among nodes [m²], shape (n,)."""
        corners = faces.corners
        area = _positive_area(faces.at, depth[corners])
        mask = (pressed | (depth > 0.0))[corners]
        share = (area / np.maximum(mask.sum(axis=1), 1))[:, None] * mask * self._covered[corners]
        return np.asarray(np.bincount(corners.ravel(), share.ravel(), minlength=self._count)[self._near])


def _slopes(nodes: Ints32, rise: Array, count: int) -> Array:
    """Mean slope (rise over length) of the edges from each node, where it faces the other side, shape (count,)."""
    seen = np.isfinite(rise)
    sine = np.clip(rise[seen], 0.0, _STEEPEST)
    total = np.bincount(nodes[seen], sine / np.sqrt(1.0 - sine**2), count)
    return np.asarray(total / np.maximum(np.bincount(nodes[seen], minlength=count), 1))


class _Faces:
    """Faces with corners (F, 4) among ``count`` nodes, at positions (F, 4, 3), and their directed edges."""

    def __init__(self, corners: Ints32, at: Array, count: int) -> None:
        self.corners, self.at, self._count = corners, at, count
        start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
        way = (np.roll(at, -1, axis=1) - at).reshape(-1, 3)
        self._start, self._end = np.concatenate([start, end]), np.concatenate([end, start])
        self._way = np.concatenate([way, -way])

    def across(self, inside: Mask) -> tuple[Ints32, Ints32, Array]:
        """Edges that leave a set of nodes: start nodes, end nodes, and lengths [m]."""
        chosen = inside[self._start] & ~inside[self._end]
        length = np.linalg.norm(self._way[chosen], axis=1)
        return self._start[chosen], self._end[chosen], np.maximum(length, 1e-300)

    def inwards(self, values: Array, inside: Mask, i: Ints32, j: Ints32) -> Array:
        """Values at the inner neighbours of i that continue edges j → i most straightly; 0 if there are none."""
        place = np.zeros((self._count, 3))
        place[self.corners.ravel()] = self.at.reshape(-1, 3)
        kept = inside[self._start] & inside[self._end]
        start, end = self._start[kept], self._end[kept]
        order = np.argsort(start, kind="stable")
        start, end = start[order], end[order]
        first, last = np.searchsorted(start, i), np.searchsorted(start, i, side="right")
        out, best = np.zeros(len(i)), np.full(len(i), 0.5)
        for k in range(int((last - first).max(initial=0))):
            rows = np.flatnonzero(first + k < last)
            inner = end[first[rows] + k]
            back, on = place[i[rows]] - place[inner], place[j[rows]] - place[i[rows]]
            size = np.linalg.norm(back, axis=1) * np.linalg.norm(on, axis=1)
            straight = np.einsum("ni,ni->n", back, on) / np.maximum(size, 1e-300)
            better = straight > best[rows]
            best[rows[better]], out[rows[better]] = straight[better], values[inner[better]]
        return out

    def depth(self, inside: Mask, i: Ints32, j: Ints32, f: Array) -> Array:
        """Signed distance of nodes from a border in edge lengths, positive inside, shape (m,).

        The border crosses edges i → j at f edge lengths beyond i; values at nodes are means over their edges, limited
        to differ by 1 from node to node.
        """
        count, start, end = self._count, self._start, self._end
        out = np.where(inside, 1.0, -1.0)
        alone = np.ones(count, dtype=bool)
        alone[start[inside[start] & inside[end]]] = False
        f = np.where(alone[i], np.maximum(f, 0.0), f)  # an isolated node in contact is inside the border
        for nodes, values in ((i, f), (j, f - 1.0)):
            total, number = np.bincount(nodes, values, count), np.bincount(nodes, minlength=count)
            out = np.where(number > 0, total / np.maximum(number, 1), out)
        rim, edge = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        rim[i], edge[j] = True, True
        inner = inside[start] & ~rim[start] & rim[end]
        least = np.full(count, np.inf)
        np.minimum.at(least, start[inner], out[end[inner]] + 1.0)
        out = np.where(np.isfinite(least), least, out)
        outer = ~inside[start] & ~edge[start] & edge[end]
        most = np.full(count, -np.inf)
        np.maximum.at(most, start[outer], out[end[outer]] - 1.0)
        return np.where(np.isfinite(most), np.minimum(most, 0.0), out)


def _positive_area(at: Array, values: Array) -> Array:
    """Area of the part of quadrilaterals (F, 4, 3) in which interpolated corner values (F, 4) are positive, (F,)."""
    polygon = np.zeros((len(at), 8, 3))
    used = np.zeros((len(at), 8), dtype=bool)
    for k in range(4):
        here, there = values[:, k], values[:, (k + 1) % 4]
        used[:, 2 * k] = here > 0.0
        used[:, 2 * k + 1] = (here > 0.0) != (there > 0.0)
        share = here / np.where(used[:, 2 * k + 1], here - there, 1.0)
        polygon[:, 2 * k] = at[:, k]
        polygon[:, 2 * k + 1] = at[:, k] + share[:, None] * (at[:, (k + 1) % 4] - at[:, k])
    for k in range(16):  # unused corners coincide with the corner before them
        polygon[:, k % 8] = np.where(used[:, k % 8, None], polygon[:, k % 8], polygon[:, (k - 1) % 8])
    from_first = polygon - polygon[:, :1]
    vector = 0.5 * np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1)
    return np.where(used.any(axis=1), np.linalg.norm(vector, axis=1), 0.0)
