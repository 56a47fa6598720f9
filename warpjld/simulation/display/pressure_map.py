"""Conservative mapping of nodal contact forces to pressure on a visible surface (R95)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.results.nodal_contact import tributary_areas
from warpjld.fem.mesh.embedding import Embedding, embed_between
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.simulation.bodies.deformable_body import DeformableBody
from warpjld.simulation.display.refine import RefinedSurface, refine_surface

__all__ = ["PressureMap", "pressure_map"]

_SEEN = 0.5
"""Least ratio of the visible area carried by a node to its tributary area; forces on nodes with less (where the surface
is coarser than the elements or cut off) go to the closest point of the surface."""


class PressureMap:
    """Distributes normal forces at a volume's outer nodes over the embedded surface.

    A node's force is distributed among the vertices it carries in proportion to their weights and areas: pressures are
    interpolated linearly between nodes, and their integral equals the force.

    Args:
        mesh: The volume in its reference configuration.
        faces: Name of its face set.
        carried: Embedding of the vertices.
        vertices: Vertices in the same configuration [m], shape (V, 3).
        triangles: Triangles of the whole surface, shape (T, 3).
        embedded: Mask of the vertices that the volume carries, shape (V,).
    """

    def __init__(
        self,
        mesh: HexMesh,
        faces: str,
        carried: Embedding,
        vertices: NDArray[np.float64],
        triangles: NDArray[np.int32],
        embedded: NDArray[np.bool_],
    ) -> None:
        from scipy.sparse import csr_array, diags_array

        count, total = len(vertices), len(mesh.nodes)
        self._triangles, self._count = triangles, count
        around = tributary_areas(mesh, faces, mesh.nodes)
        weights = np.maximum(carried.weights, 0.0) * (around > 0.0)[carried.corners]
        weights *= embedded[:, None]
        weights /= np.maximum(weights.sum(axis=1), 1e-12)[:, None]
        table = csr_array((weights.ravel(), carried.corners.ravel(), 8 * np.arange(count + 1)), shape=(count, total))
        seen = table.T @ self._areas(vertices) > _SEEN * np.maximum(around, 1e-300)
        self._table: Any = table @ diags_array(seen.astype(float))
        self._bare = np.flatnonzero((around > 0.0) & ~seen)
        self._nearest: Any = csr_array((count, len(self._bare)))
        whole = triangles[embedded[triangles].all(axis=1)]
        if len(self._bare) and len(whole):
            surface = Facets(vertices, whole)
            place = surface.locate(mesh.nodes[self._bare])[1]
            corners = surface.faces[place.face]
            columns = 3 * np.arange(len(self._bare) + 1)
            shape = (len(self._bare), count)
            self._nearest = csr_array((place.weights.ravel(), corners.ravel(), columns), shape=shape).T

    def of(self, force: NDArray[np.float64], vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Pressure at the vertices [Pa], shape (V,), from normal forces on the nodes (N,) [N] and current vertices
        (V, 3) [m]."""
        area = self._areas(vertices)
        out = self._table @ _over(force, self._table.T @ area)
        return np.asarray(out + _over(self._nearest @ force[self._bare], area), np.float64)

    def _areas(self, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """A third of the triangles around every vertex [m²], shape (V,)."""
        x = vertices[self._triangles]
        size = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 6.0
        return np.asarray(np.bincount(self._triangles.ravel(), np.repeat(size, 3), self._count), np.float64)


def pressure_map(body: DeformableBody, force: NDArray[np.float64]) -> tuple[RefinedSurface, PressureMap]:
    """A body's surface, refined where it is ever in contact, and its pressure map.

    Args:
        body: The body.
        force: Largest normal force on the nodes over all frames [N], shape (N,).
    """
    triangles, carried, embedded = body.triangles, body.embedding, body.embedded
    count = len(body.surface)
    pressed = embedded & (np.where(carried.weights > 0.0, force[carried.corners], 0.0).max(axis=1) > 0.0)
    surface = refine_surface(triangles, embedded[triangles].all(axis=1) & pressed[triangles].any(axis=1), count)
    where = surface.of(body.surface)
    if len(surface.edges):
        middles = embed_between(body.mesh, carried, surface.edges, where[count:])
        columns = (getattr(carried, name) for name in ("corners", "weights", "outside"))
        more = (getattr(middles, name) for name in ("corners", "weights", "outside"))
        carried = Embedding(*(np.concatenate(pair) for pair in zip(columns, more, strict=True)))
    inside = np.concatenate([embedded, embedded[surface.edges].all(axis=1)])
    return surface, PressureMap(body.mesh, body.faces, carried, where, surface.faces, inside)


def _over(force: NDArray[np.float64], area: NDArray[np.float64]) -> NDArray[np.float64]:
    """Force over area, 0 where the area is 0."""
    return np.divide(force, area, out=np.zeros(len(area)), where=area > 0.0)
