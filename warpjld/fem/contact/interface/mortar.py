"""Mortar integrals between two deformable surfaces: weighted gaps at slave nodes (Puso & Laursen 2004)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.contact.interface.common_normals import FacingParts
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.pair_filter import counted_share
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.interface.surface import ContactSurface
from warpjld.fem.launch import on_rows, shared
from warpjld.geometry.rotations import unit

__all__ = ["Mortar"]

_FACING = -0.2
"""Cosine of the angle between facet normals below which facets may be in contact."""
_ROUNDED = 1e-9
"""Addition to it, and to radii of facets, relatively, where pairs are sorted out: rounding then decides nothing."""
_TURN = 0.4
"""Width of the transition below that cosine to full contact."""
_LEAST, _SLIVER, _OFF = 0.05, 0.1, 0.25
"""Share of a node's tributary area facing the other side, below which it is no contact point, and below which its gap
is an average over a sliver. Between the two the point fades out: its gap is enlarged by up to the third number times
the edge, and the surface offset is faded. The reason: pressure on a sliver has hardly any area, and so no bound, and
the average over it may decrease while the sides separate, so that there would be no solution. Points beside it carry
the load instead."""


_KEPT = 3
"""Number of positions whose integrals are kept: those at the start of a load step, and at two first guesses."""
_AHEAD = 0.25
"""Displacement of a node, over the search distance, after which facet pairs are searched again."""


@dataclass(frozen=True, eq=False)
class _Near:
    """Candidate facet pairs (P, 2) found at positions x (N, 3) for a search distance ``reach``."""

    x: Array
    reach: float
    pairs: Ints32

    def serves(self, x: Array, *surfaces: ContactSurface) -> bool:
        """Whether the list is complete at positions x (N, 3): no node of the surfaces has moved too far."""
        moved = max(float(np.abs(x[one.nodes] - self.x[one.nodes]).max()) for one in surfaces)
        return moved < 0.99 * _AHEAD * self.reach


@dataclass(frozen=True, eq=False)
class _Facing:
    """Facet pairs (P, 2) that face each other at positions x (N, 3) for a search distance, and their integrals; and the
    contact points found from them, with the arguments that these were found for."""

    x: Array
    reach: float
    pairs: Ints32
    integrals: Array
    points: list[tuple[Array, bool, ContactPoints]] = field(default_factory=list)


def _boxes(x: Array, surface: ContactSurface) -> tuple[Array, Array]:
    """Bounding boxes of facets: lowest and highest coordinates [m], shape (F, 3) each."""
    corners = x[surface.quads]
    return corners.min(axis=1), corners.max(axis=1)


class Mortar:
    """Mortar discretisation of two surfaces: integrals over the overlaps of their facets.

    Args:
        slave: Slave (non-mortar) surface, which carries the multipliers.
        master: Master (mortar) surface; may be the same.
        pair: Exclusions and offset.
        count: Number of nodes of the body, N.
        threads: Number of threads.

    Attributes:
        slave, master, threads: As given.
        offset: Height of the visible surface above the nodes [m], shape (N,); None without.
        labels: Labels of the slave's and the master's facets, shapes (F,) and (G,).
        joined, fringe: See ``Exclusion``.
    """

    def __init__(self, slave: ContactSurface, master: ContactSurface, pair: Pair, count: int, threads: int) -> None:
        self.slave, self.master = slave, master
        self.offset = pair.offset
        self._count, self.threads = count, threads
        exclusion = pair.exclusion
        if exclusion is None:
            mine, other = np.zeros(len(slave.quads), np.int32), np.zeros(len(master.quads), np.int32)
            never = joined = np.zeros((1, 1), np.uint8)
        else:
            mine, other = (np.asarray(a, dtype=np.int32) for a in (exclusion.slave, exclusion.master))
            never = np.array(exclusion.never, dtype=np.uint8)
            joined = never.copy() if exclusion.joined is None else np.array(exclusion.joined, dtype=np.uint8)
            if mine.shape != (len(slave.quads),) or other.shape != (len(master.quads),):
                raise InputError(
                    f"{pair.title}: want one label for each of {len(slave.quads)} slave and {len(master.quads)} "
                    f"master faces, got {mine.shape} and {other.shape}"
                )
            if never.ndim != 2 or never.shape[0] != never.shape[1]:
                raise InputError(f"{pair.title}: never: want a square table of labels, got shape {never.shape}")
            if max(mine.max(), other.max()) >= len(never) or min(mine.min(), other.min()) < 0:
                raise InputError(f"{pair.title}: labels must lie in 0…{len(never) - 1}")
        same = slave.quads.shape == master.quads.shape and bool((slave.quads == master.quads).all())
        if same:
            if exclusion is None:
                raise InputError(f"{pair.title}: self-contact needs an exclusion that labels the parts of the surface")
            never |= np.tril(np.ones_like(never))
        self.labels = np.ascontiguousarray(mine), np.ascontiguousarray(other)
        self.joined = joined
        self.fringe = None if exclusion is None else exclusion.fringe
        self._never = never
        self._near: _Near | None = None
        self._last: list[_Facing] = []

    def points(self, x: Array, reach: float, normals: Array, *, facing: bool = False) -> ContactPoints:
        """Contact points at positions x (N, 3) [m].

        Only facets that face each other with a distance or depth of at most ``reach`` [m] count.

        Args:
            x: Positions of the body's nodes [m], shape (N, 3).
            reach: Search distance [m].
            normals: Normals of the slave's nodes, shape (m, 3).
            facing: Whether points have instead the normals of those parts of both sides' faces that face each other
                (``facing_normals``).
        """
        at = self._facing(x, reach)
        for by, sort, points in at.points:  # line searches and their Newton steps end at the same positions
            if sort == facing and np.array_equal(by, normals):
                return points
        points = self._found(at, normals, facing=facing)
        at.points.append((normals.copy(), facing, points))
        return points

    def _found(self, at: _Facing, normals: Array, *, facing: bool) -> ContactPoints:
        """Contact points of facet pairs; arguments as of ``points``."""
        slave, master, x, pairs, found = self.slave, self.master, at.x, at.pairs, at.integrals
        share = counted_share(self, pairs, found, normals, x, at.reach)
        counted = share > 0.0
        pairs, share = pairs[counted], share[counted]
        found = share[:, None] * found[counted]
        corner = slave.corners[pairs[:, 0]]
        rows = np.repeat(corner, 4, axis=1)
        own = np.tile(slave.quads[pairs[:, 0]], 4)
        far = np.tile(master.quads[pairs[:, 1]], 4)
        entries = np.concatenate([found[:, :16].ravel(), -found[:, 16:32].ravel()])
        places = (np.concatenate([rows.ravel(), rows.ravel()]), np.concatenate([own.ravel(), far.ravel()]))
        table = csr_array(coo_array((entries, places), shape=(len(slave.nodes), self._count)))
        area = np.asarray(np.bincount(rows.ravel(), found[:, :16].ravel(), minlength=len(slave.nodes)), np.float64)
        nodes: Ints = np.flatnonzero(area > _LEAST * slave.edge**2)
        table = table[nodes]
        table.data /= np.repeat(area[nodes], np.diff(table.indptr))
        table.sort_indices()
        normal = self.facing_normals(x, pairs, found)[nodes] if facing else normals[nodes]
        gap = np.asarray(-np.einsum("mi,mi->m", normal, table @ x), np.float64)
        gap += self.sliver_offset(nodes, area[nodes])[0]
        if self.offset is not None:
            gap -= self.sliver_share(nodes, area[nodes])[0] * (abs(table) @ self.offset)
        return ContactPoints(nodes, table, normal, area[nodes], gap, np.zeros((len(nodes), 3)), pairs, share)

    def facing_normals(self, x: Array, pairs: Ints32, integrals: Array) -> Array:
        """Normals of slave nodes, of those parts of the faces of both sides that face each other (``FacingParts``).

        At a ridge of the slave of which one side touches, the mean over all faces (as at other nodes) would point past
        the other side: the gap along it would shrink by the cosine, but not the offset of the visible surface; pressure
        would push sideways, and bending the ridge inwards could close the gap instead of opening it.

        Args:
            x: Positions of the body's nodes [m], shape (N, 3).
            pairs: Facets that face each other, shape (P, 2).
            integrals: Their mortar integrals, shape (P, 33).

        Returns:
            Unit normals of the slave's nodes, 0 where nothing faces them, shape (m, 3).
        """
        slave = self.slave
        share = integrals[:, :16].reshape(-1, 4, 4).sum(axis=2)
        sides = [unit(side.area_vectors(x)[pairs[:, k]]) for k, side in enumerate((slave, self.master))]
        where = slave.corners[pairs[:, 0]].astype(np.int64)
        return FacingParts.of(where, len(slave.nodes), share, sides[0], sides[1]).normals

    def met_by(self, label: int) -> Mask:
        """Mask of the master facets that slave facets of a label may touch, shape (G,)."""
        return np.asarray(self._never[label, self.labels[1]] == 0)

    def sliver_offset(self, sites: Ints, area: Array) -> tuple[Array, Array]:
        """Enlargement of the gaps of slivers [m], and its derivative by their area [1/m], shape (m,) each."""
        t, per_area = self.sliver_share(sites, area)
        edge = self.slave.edge[sites]
        return _OFF * edge * (1.0 - t) ** 2, -2.0 * _OFF * edge * (1.0 - t) * per_area

    def sliver_share(self, sites: Ints, area: Array) -> tuple[Array, Array]:
        """Fading factor of points with little area, 0 to 1, and its derivative by area [1/m²], shape (m,) each."""
        whole = (_SLIVER - _LEAST) * self.slave.edge[sites] ** 2
        t = (area - _LEAST * self.slave.edge[sites] ** 2) / whole
        return np.clip(t, 0.0, 1.0), np.where((t > 0.0) & (t < 1.0), 1.0 / whole, 0.0)

    def _facing(self, x: Array, reach: float) -> _Facing:
        """Facet pairs that face each other, and their integrals; the last results are cached."""
        if (known := self._known(x, reach)) is not None:
            return known
        pairs = self._worth_integrating(self._neighbours(x, reach), x, reach)
        found = self.integrals(pairs, self.slave.quads, self.master.quads, x, reach)
        overlapping = found[:, 32] > 0.0
        self._last = [*self._last[1 - _KEPT :], _Facing(x.copy(), reach, pairs[overlapping], found[overlapping])]
        return self._last[-1]

    def _known(self, x: Array, reach: float) -> _Facing | None:
        """What is cached for positions x (N, 3) and a search distance."""
        same = (one for one in reversed(self._last) if one.reach == reach and np.array_equal(one.x, x))
        return next(same, None)

    def integrals_of(self, pairs: Ints32, x: Array, reach: float) -> Array:
        """Mortar integrals of facet pairs (P, 2) of the surfaces at positions x (N, 3), shape (P, 33): those of the
        contact points there, if these are known."""
        if (known := self._known(x, reach)) is not None and len(known.pairs):
            keys, wanted = (one @ np.array([len(self.master.quads), 1], np.int64) for one in (known.pairs, pairs))
            at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            if np.array_equal(keys[at], wanted):
                return np.asarray(known.integrals[at])
        return self.integrals(pairs, self.slave.quads, self.master.quads, x, reach)

    def _worth_integrating(self, pairs: Ints32, x: Array, reach: float) -> Ints32:
        """Those of the pairs (P, 2) whose integrals may differ from 0, by the spheres around their facets."""
        import warp as wp
        from warpjld_kernels import contact_facets

        tables: list[Any] = []
        for surface in (self.slave, self.master):
            corners = x[surface.quads]
            centre = corners.mean(axis=1)
            away = corners - centre[:, None]
            radius = (1.0 + _ROUNDED) * np.sqrt(np.einsum("fci,fci->fc", away, away).max(axis=1))
            tables.append(wp.array(centre, dtype=wp.vec3d, device="cpu", copy=False))
            tables.append(shared(radius))
            tables.append(wp.array(unit(surface.area_vectors(x)), dtype=wp.vec3d, device="cpu", copy=False))
        near = np.empty(len(pairs), np.uint8)
        if len(pairs):
            arguments = [shared(pairs), *tables, reach, _FACING + _ROUNDED, shared(near)]
            on_rows(contact_facets.near_and_facing, len(pairs), arguments, threads=self.threads)
        return np.ascontiguousarray(pairs[near > 0])

    def _neighbours(self, x: Array, reach: float) -> Ints32:
        """Candidate facet pairs, shape (P, 2), sorted: a superset of those whose boxes are within ``reach`` [m].

        Searched again only when a node has moved so far that the list may be incomplete.
        """
        near = self._near
        if near is None or near.reach != reach or not near.serves(x, self.slave, self.master):
            near = self._near = _Near(x.copy(), reach, self._within(x, reach + 2.0 * _AHEAD * reach))
        return near.pairs

    def _within(self, x: Array, reach: float) -> Ints32:
        """Slave and master facets whose bounding boxes are within ``reach`` [m], shape (P, 2), sorted by both."""
        import warp as wp
        from warpjld_kernels import contact_facets

        origin = x[self.slave.nodes].mean(axis=0)
        boxes = [_boxes(x - origin, surface) for surface in (self.slave, self.master)]
        bvh = wp.Bvh(*(wp.array(b.astype(np.float32), dtype=wp.vec3, device="cpu") for b in boxes[1]))
        count = len(self.slave.quads)
        sides = (boxes[0][0] - reach, boxes[0][1] + reach)
        lower, upper = (wp.array(b.astype(np.float32), dtype=wp.vec3, device="cpu") for b in sides)
        mine, other, never = (shared(a) for a in (*self.labels, self._never))
        starts, counts = np.zeros(count + 1, np.int32), np.zeros(count, np.int32)
        inputs: list[Any] = [bvh.id, lower, upper, mine, other, never]
        out = np.empty(1, np.int32)
        for fill in (False, True):
            if fill:
                np.cumsum(counts, out=starts[1:])
                out = np.empty(max(int(starts[-1]), 1), np.int32)
            arguments = [*inputs, shared(starts), fill, shared(counts), shared(out)]
            wp.launch(contact_facets.facet_pairs, dim=count, inputs=arguments, device="cpu")
        facet = np.repeat(np.arange(count, dtype=np.int32), counts)
        pairs = np.stack([facet, out[: len(facet)]], axis=1)
        return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]

    def integrals(self, pairs: Ints32, slave: Ints32, master: Ints32, x: Array, reach: float) -> Array:
        """Mortar integrals of pairs (P, 2) of quadrilaterals with corners at x (n, 3), shape (P, 33), see the
        kernel."""
        from warpjld_kernels import contact_mortar

        out = np.zeros((len(pairs), 33))
        if len(pairs):
            tables = [np.ascontiguousarray(a).reshape(-1) for a in (pairs, slave, master, x)]
            arguments = [*(shared(t) for t in tables), _FACING, _TURN, reach, shared(out.reshape(-1))]
            on_rows(contact_mortar.integrate, len(pairs), arguments, threads=self.threads, least=200)
        return out

    def derivatives(self, pairs: Ints32, x: Array, reach: float) -> Array:
        """Derivatives of the integrals of pairs (P, 2) by their corners' coordinates, slave's first, (P, 24, 33).

        Per pair: corners shared by several pairs contribute to each pair separately.
        """
        from warpjld_kernels import contact_mortar

        out = np.empty((len(pairs), 24, 33))
        if len(pairs):
            kept = (pairs, self.slave.quads, self.master.quads, x)
            tables = [shared(np.ascontiguousarray(a).reshape(-1)) for a in kept]
            arguments = [*tables, _FACING, _TURN, reach, shared(out.reshape(-1))]
            on_rows(contact_mortar.differentiate, len(pairs), arguments, threads=self.threads, least=50)
        return out
