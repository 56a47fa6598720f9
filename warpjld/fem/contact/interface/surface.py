"""Contact surfaces: boundary faces of a body, their nodes, normals and areas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.geometry.rotations import unit

__all__ = ["ContactSurface", "surface_of"]

_LARGE = 1.5
"""Bound on the edge that determines the search distance, over the median edge: a hand is thin."""


@dataclass(frozen=True, eq=False)
class ContactSurface:
    """Boundary quadrilaterals and their nodes.

    Attributes:
        quads: Nodes of the body at each face's corners, anticlockwise seen from outside, shape (F, 4).
        nodes: Nodes of the body that lie on it, ascending, shape (m,).
        corners: ``quads`` as indices into ``nodes``, shape (F, 4).
        edge: Typical edge of the faces at each node, at rest [m], shape (m,).
    """

    quads: Ints32
    nodes: Ints32
    corners: Ints32
    edge: Array

    @property
    def reach(self) -> float:
        """Search distance of its points [m]."""
        return 2.0 * min(float(self.edge.max()), _LARGE * float(np.median(self.edge)))

    def area_vectors(self, x: Array) -> Array:
        """Area times outward normal of each face at positions x (N, 3) [m²], shape (F, 3)."""
        a, b, c, d = (x[self.quads[:, k]] for k in range(4))
        out: Array = 0.5 * np.cross(c - a, d - b)
        return out

    def at_nodes(self, faces: Array) -> Array:
        """Face values distributed equally to the corners, shape (m, …)."""
        flat = np.repeat(faces.reshape(len(faces), -1) / 4.0, 4, axis=0)
        where = self.corners.ravel()
        columns = [np.bincount(where, weights=column, minlength=len(self.nodes)) for column in flat.T]
        out: Array = np.asarray(np.stack(columns, axis=1), np.float64).reshape(-1, *faces.shape[1:])
        return out

    def normals(self, x: Array) -> Array:
        """Outward unit normals at the nodes: area-weighted averages over the faces, shape (m, 3)."""
        return unit(self.at_nodes(self.area_vectors(x)))


def surface_of(mesh: HexMesh, faces: str | Ints32, what: str) -> ContactSurface:
    """Contact surface of a named face set, or of faces (element, local face), shape (F, 2).

    Raises:
        InputError: Unknown face set, faces that the mesh lacks, or no faces.
    """
    if isinstance(faces, str):
        try:
            found = mesh.face_set(faces)
        except InputError as error:
            raise InputError(f"{what}: {error.message}") from error
    else:
        found = np.asarray(faces)
        if found.ndim != 2 or found.shape[1] != 2:
            raise InputError(f"{what}: want faces of shape (n, 2), got {found.shape}")
        if len(found) and (found.min() < 0 or found[:, 0].max() >= len(mesh.elements) or found[:, 1].max() > 5):
            raise InputError(f"{what}: faces must name an element in 0…{len(mesh.elements) - 1} and a face in 0…5")
    if len(found) == 0:
        raise InputError(f"{what}: no faces")
    quads = np.ascontiguousarray(mesh.quads(found), dtype=np.int32)
    nodes, inverse = np.unique(quads, return_inverse=True)
    corners: Ints32 = np.asarray(inverse, dtype=np.int32).reshape(quads.shape)
    surface = ContactSurface(quads, nodes.astype(np.int32), corners, np.empty(len(nodes)))
    area = np.linalg.norm(surface.area_vectors(mesh.nodes), axis=1)
    used = np.bincount(corners.ravel(), minlength=len(nodes))
    edge = np.sqrt(4.0 * surface.at_nodes(area) / np.maximum(used, 1))
    return ContactSurface(surface.quads, surface.nodes, corners, edge)
