"""Contact interface: search for contact points of a pair, by mortar integration or closest-point projection."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array, eye_array

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32
from warpjld.fem.contact.interface.contact_points import ContactPoints
from warpjld.fem.contact.interface.mortar import Mortar
from warpjld.fem.contact.interface.pairs import Pair
from warpjld.fem.contact.interface.surface import ContactSurface, surface_of
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Obstacle
from warpjld.fem.mesh.hexmesh import HexMesh

__all__ = ["Interface", "interfaces_of"]

_NEAR, _FAR = 0.5 * (1.0 + 1.0 / np.sqrt(3.0)), 0.5 * (1.0 - 1.0 / np.sqrt(3.0))
"""Linear shape functions of an edge at its two Gauss points."""
_GAUSS = np.array(
    [
        [_NEAR * _NEAR, _NEAR * _FAR, _FAR * _FAR, _NEAR * _FAR],
        [_NEAR * _FAR, _NEAR * _NEAR, _NEAR * _FAR, _FAR * _FAR],
        [_FAR * _FAR, _NEAR * _FAR, _NEAR * _NEAR, _NEAR * _FAR],
        [_NEAR * _FAR, _FAR * _FAR, _NEAR * _FAR, _NEAR * _NEAR],
    ]
)
"""Bilinear shape functions of a face's corners at its 2 × 2 Gauss points."""


class Interface:
    """Discretised contact pair that finds its contact points at any configuration.

    Between two deformable surfaces, sites are slave nodes, and their points are weighted averages (mortar method, Puso
    & Laursen 2004). Against an obstacle, sites are the slave nodes, or the 2 × 2 Gauss points of each slave face, which
    also detect edges of the obstacle between nodes.

    Attributes:
        pair: The pair.
        slave: Its slave surface.
        opposite: Nodes of the master surface; empty for an obstacle.
        edge: Edge of the slave faces at each site, at rest [m], shape (sites,).
        share: Weights of slave nodes at each site, ``csr_array`` (sites, m), rows sum to one.
        reach: Search distance [m].
    """

    def __init__(self, mesh: HexMesh, pair: Pair, threads: int) -> None:
        self.pair = pair
        self.slave: ContactSurface = surface_of(mesh, pair.slave, f"{pair.title}: slave")
        self._count = len(mesh.nodes)
        if pair.offset is not None and len(pair.offset) != self._count:
            raise InputError(f"{pair.title}: offset: want {self._count} lengths, one a node, got {len(pair.offset)}")
        self.mortar: Mortar | None = None
        self.share: Any
        if not isinstance(pair.master, Obstacle):
            master = surface_of(mesh, pair.master, f"{pair.title}: master")
            self.mortar = Mortar(self.slave, master, pair, self._count, threads)
            self.opposite = master.nodes
            self.edge = self.slave.edge
            self.share = eye_array(len(self.slave.nodes), format="csr")
        elif pair.sites == "nodes":
            self.opposite = np.empty(0, np.int32)
            self.edge = self.slave.edge
            self.share = eye_array(len(self.slave.nodes), format="csr")
        else:
            self.opposite = np.empty(0, np.int32)
            faces = len(self.slave.quads)
            area = np.linalg.norm(self.slave.area_vectors(mesh.nodes), axis=1)
            self.edge = np.repeat(np.sqrt(area), 4)
            table = (np.tile(_GAUSS, (faces, 1)).ravel(), np.repeat(self.slave.corners, 4, axis=0).ravel())
            rows = 4 * np.arange(4 * faces + 1)
            self.share = csr_array((*table, rows), shape=(4 * faces, len(self.slave.nodes)))
        farthest = 0.0 if pair.offset is None else 2.0 * float(np.abs(pair.offset).max(initial=0.0))
        self.reach = self.slave.reach + farthest

    @property
    def averages(self) -> bool:
        """Whether gaps at slave nodes are averages over the faces around them."""
        return self.mortar is not None or self.pair.sites == "faces"

    @property
    def slides(self) -> bool:
        """Whether the tangent contains derivatives of its weights and normals: both sides deform and are not bonded."""
        return self.mortar is not None and self.pair.bond is None

    def points(self, x: Array, before: float, time: float, normals: Array | None = None) -> ContactPoints:
        """Contact points at positions x (N, 3) [m] and a time, for a step that began at ``before``.

        ``normals`` of the slave nodes (m, 3), for bonded mortar interfaces, are those at x unless given.
        """
        if self.mortar is None:
            probe = self._at_nodes(x, time) if self.pair.sites == "nodes" else self._at_faces(x, time)
            found = self._against(probe, before, time)
        else:
            known = self.slave.normals(x) if normals is None else normals
            return self.mortar.points(x, self.reach, known, facing=self.slides)
        if self.pair.offset is None:
            return found
        return replace(found, gap=found.gap - abs(found.weights) @ self.pair.offset)

    def _at_nodes(self, x: Array, time: float) -> _Probe:
        surface = self.slave
        vectors = surface.at_nodes(surface.area_vectors(x))
        area = surface.at_nodes(np.linalg.norm(surface.area_vectors(x), axis=1))
        found = self._obstacle.project(x[surface.nodes], time)
        near = self._near(found, vectors)
        columns, rows = surface.nodes[near], np.arange(len(near) + 1)
        return _Probe(near, np.ones(len(near)), columns, rows, area[near], _picked(found, near))

    def _at_faces(self, x: Array, time: float) -> _Probe:
        surface = self.slave
        at_nodes = self._obstacle.project(x[surface.nodes], time).distance
        close = at_nodes[surface.corners].min(axis=1) < 2.0 * self.reach
        sites = np.flatnonzero(np.repeat(close, 4))
        found = self._obstacle.project(self.share[sites] @ x[surface.nodes], time)
        vectors = surface.area_vectors(x)[sites // 4]
        near = self._near(found, vectors)
        sites = sites[near]
        columns, rows = surface.quads[sites // 4].ravel(), 4 * np.arange(len(near) + 1)
        area = np.linalg.norm(vectors[near], axis=1) / 4.0
        return _Probe(sites, _GAUSS[sites % 4].ravel(), columns, rows, area, _picked(found, near))

    @property
    def _obstacle(self) -> Obstacle:
        assert isinstance(self.pair.master, Obstacle)
        return self.pair.master

    def _near(self, found: ClosestPoints, vectors: Array) -> Ints:
        """Indices of points within the search distance; of penetrating ones, only those whose area vectors face the
        obstacle's surface, since the far side of a thin body does not touch it."""
        against = np.einsum("ni,ni->n", vectors, found.normal) < 0.5 * np.linalg.norm(vectors, axis=1)
        return np.flatnonzero((found.distance < self.reach) & (against | (found.distance > 0.0)))

    def _against(self, probe: _Probe, before: float, time: float) -> ContactPoints:
        weights = csr_array((probe.values, probe.columns, probe.rows), shape=(len(probe.sites), self._count))
        weights.sum_duplicates()  # corners of a degenerate face coincide
        found = probe.found
        carried = found.closest - self._obstacle.carried(found.closest, time, before)
        return ContactPoints(probe.sites, weights, -found.normal, probe.area, found.distance, carried)


@dataclass(frozen=True, eq=False)
class _Probe:
    """Sites near an obstacle: CSR values, columns and row pointers of their weights, areas, closest points."""

    sites: Ints
    values: Array
    columns: Ints32
    rows: Ints
    area: Array
    found: ClosestPoints


def _picked(found: ClosestPoints, rows: Ints) -> ClosestPoints:
    return ClosestPoints(found.distance[rows], found.closest[rows], found.normal[rows])


def interfaces_of(mesh: HexMesh, pairs: list[Pair], threads: int) -> list[Interface]:
    """Interfaces of all pairs of a mesh.

    Raises:
        InputError: No pair, or one with unknown faces.
    """
    if not pairs:
        raise InputError("pairs: want at least one pair of surfaces that may touch")
    return [Interface(mesh, pair, threads) for pair in pairs]
