"""Derivatives of what contact points are made of, weights and normals, facet pair by facet pair."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array

from warpjld.fem.arrays import Array, Ints, Mask, cross_matrix
from warpjld.fem.contact.interface.common_normals import FacingParts
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.mortar import Mortar

__all__ = ["FacetPairs"]


class FacetPairs:
    """Facet pairs of some contact points, with the derivatives of their mortar integrals.

    Attributes:
        rows: Indices of the points, among m.
        corner: Point at each corner of the slave facets, -1 for none of these, shape (P, 4).
        column: Degrees of freedom of the corners, slave's first, shape (P, 24).
        own: Derivatives of ∫ N_a N_b with respect to them, shape (P, 24, 4, 4).
        far: Derivatives of ∫ N_a M_b, likewise.
    """

    def __init__(self, mortar: Mortar, points: ContactPoints, rows: Ints, x: Array, reach: float) -> None:
        assert points.facets is not None
        assert points.share is not None
        slave = mortar.slave
        number = np.full(len(slave.nodes), -1)
        number[points.sites[rows]] = rows
        chosen = (number[slave.corners[points.facets[:, 0]]] >= 0).any(axis=1)
        facets, share = points.facets[chosen], points.share[chosen]
        nodes = np.concatenate([slave.quads[facets[:, 0]], mortar.master.quads[facets[:, 1]]], axis=1)
        self.rows = rows
        self.corner = number[slave.corners[facets[:, 0]]]
        self.column = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 24)
        self._mortar, self._points, self._at, self._size = mortar, points, x[nodes], x.size
        found = mortar.integrals_of(facets, x, reach)
        self._area = share[:, None] * found[:, :16].reshape(-1, 4, 4).sum(axis=2)
        change = mortar.derivatives(facets, x, reach)
        change *= share[:, None, None]
        self.own, self.far = (change[:, :, k : k + 16].reshape(-1, 24, 4, 4) for k in (0, 16))

    def gaps(self, apart: Array) -> Any:
        """Derivatives of the gaps through weights and normals, ``csr_array`` (m, 3N), for the relative positions of the
        two sides at the points [m], shape (m, 3)."""
        points, corner = self._points, self.corner
        off, per_area = self._mortar.sliver_offset(points.sites, points.area)
        wider = self.own.sum(axis=3)
        along = np.matmul(points.normal[corner], self._at.transpose(0, 2, 1))  # of the pair's nodes along the normals
        along[:, :, 4:] *= -1.0
        if self._mortar.offset is not None:
            share, by_area = self._mortar.sliver_share(points.sites, points.area)
            along += share[corner][:, :, None] * self._mortar.offset[self.column[:, ::3] // 3][:, None]
            per_area = per_area - by_area * (abs(points.weights) @ self._mortar.offset)
        mean = np.einsum("pkab,pab->pka", self.own, along[:, :, :4])
        mean += np.einsum("pkab,pab->pka", self.far, along[:, :, 4:])
        mean += (points.gap - off)[corner][:, None] * wider
        gap = per_area[corner][:, None] * wider - mean / points.area[corner][:, None]
        gap -= self._turned_along(apart, wider)
        where = np.broadcast_to(corner[:, None] >= 0, gap.shape)
        row = np.broadcast_to(corner[:, None], gap.shape)[where]
        column = np.broadcast_to(self.column[:, :, None], gap.shape)[where]
        return csr_array(coo_array((gap[where], (row, column)), shape=(len(points.sites), self._size)))

    def forces(self, traction: Array) -> Any:
        """Derivatives of the nodal forces of tractions (m, 3) through the weights [N/m], ``csr_array`` (3N, 3N)."""
        known = np.where(self.corner[:, :, None] >= 0, traction[self.corner], 0.0)
        loaded = known.any(axis=(1, 2))
        known, column = known[loaded], self.column[loaded]
        # axes: facet pair, degree of freedom that moves, node that is loaded
        pushed = [np.matmul(part[loaded].transpose(0, 1, 3, 2), known[:, None]) for part in (self.own, -self.far)]
        block = np.concatenate(pushed, axis=2).reshape(-1, 24, 24)
        row = np.broadcast_to(column[:, None, :], block.shape)
        column = np.broadcast_to(column[:, :, None], block.shape)
        shape = (self._size, self._size)
        return csr_array(coo_array((block.ravel(), (row.ravel(), column.ravel())), shape=shape))

    def normals(self, chosen: Mask) -> Any:
        """Derivatives of the normals (``Mortar.facing_normals``) of chosen points (m,), ``csr_array`` (3m, 3N)."""
        known = (self.corner >= 0) & chosen[self.corner]
        some = known.any(axis=1)
        known, corner, area, column = known[some], self.corner[some], self._area[some], self.column[some]
        wider = self.own[some].sum(axis=3)
        changes = []
        for k, (normal, turned) in enumerate(self._facets):
            change = wider[:, :, :, None] * normal[some, None, None]
            change[:, 12 * k : 12 * k + 12] += area[:, None, :, None] * turned[some, :, None]
            changes.append(change.transpose(0, 2, 1, 3))
        change = self._facing.turned(corner, changes[0], changes[1], wider.transpose(0, 2, 1)).transpose(0, 2, 1, 3)
        used = np.broadcast_to(known[:, None, :, None], change.shape)
        row = np.broadcast_to((3 * corner[:, :, None] + np.arange(3))[:, None], change.shape)
        column = np.broadcast_to(column[:, :, None, None], change.shape)
        shape = (3 * len(chosen), self._size)
        return csr_array(coo_array((change[used], (row[used], column[used])), shape=shape))

    @cached_property
    def _facets(self) -> list[tuple[Array, Array]]:
        """Unit normals of the slave's and the master's facets, and their derivatives (``_facet_normals``)."""
        return [_facet_normals(self._at[:, 4 * k : 4 * k + 4]) for k in (0, 1)]

    @cached_property
    def _facing(self) -> FacingParts:
        """What the points' normals are made of."""
        share = np.where(self.corner >= 0, self._area, 0.0)
        normals = [normal for normal, _ in self._facets]
        return FacingParts.of(np.maximum(self.corner, 0), len(self._points.sites), share, normals[0], normals[1])

    def _turned_along(self, vectors: Array, wider: Array) -> Array:
        """Derivatives of the normals at the corners, along a vector at each point (m, 3), shape (P, 24, 4).

        ``wider`` are those of the corners' areas, likewise.
        """
        *sides, by_area = self._facing.turned_along(vectors)
        total = by_area[self.corner]
        each = []
        for (normal, turned), side in zip(self._facets, sides, strict=True):
            along = side[self.corner]
            total = total + np.einsum("pai,pi->pa", along, normal)
            each.append(self._area[:, None] * np.matmul(turned, along.transpose(0, 2, 1)))
        return np.asarray(wider * total[:, None] + np.concatenate(each, axis=1))


def _facet_normals(at: Array) -> tuple[Array, Array]:
    """Unit normals of facets with corners (P, 4, 3), shape (P, 3), and their derivatives by the corners' coordinates
    (P, 12, 3)."""
    a, b, c, d = (at[:, k] for k in range(4))
    vector = 0.5 * np.cross(c - a, d - b)
    size = np.linalg.norm(vector, axis=1)
    normal = vector / size[:, None]
    along, across = cross_matrix(c - a), cross_matrix(d - b)
    each = 0.5 * np.stack([across, -along, -across, along], axis=1)  # pair, corner, 3, 3
    plane = (np.eye(3) - normal[:, :, None] * normal[:, None, :]) / size[:, None, None]
    return normal, np.einsum("pij,pcjk->pcki", plane, each).reshape(-1, 12, 3)
