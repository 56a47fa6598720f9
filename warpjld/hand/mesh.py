"""Edge connectivity, areas and neighbourhoods of a closed manifold triangulation, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

__all__ = ["Faces", "ManifoldEdges", "area_normals", "dots", "mean_over_neighbours", "subdivide"]

Array = NDArray[np.float64]
Faces = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ManifoldEdges:
    """Edges of a closed manifold: each has exactly two faces.

    Attributes:
        ends: Vertices of each edge, the smaller index first, shape (E, 2), in ascending order.
        faces: The two faces at each edge, shape (E, 2).
        corners: Corner (0, 1, 2) of either face where the edge starts; it ends at the next corner, shape (E, 2).
        of_face: Edge between corners k and k + 1 of each face, shape (T, 3).
        count: Number of vertices.
    """

    ends: Faces
    faces: Faces
    corners: Faces
    of_face: Faces
    count: int

    @classmethod
    def of(cls, faces: Faces, count: int) -> ManifoldEdges:
        """Edges of triangles (T, 3) over ``count`` vertices."""
        start, end = faces.T.ravel(), np.roll(faces, -1, axis=1).T.ravel()
        key = np.minimum(start, end) * count + np.maximum(start, end)
        # a stable sort is several times slower than sorting the two equal keys of each edge afterwards
        order = np.sort(np.argsort(key).reshape(-1, 2), axis=1).ravel()
        first = key[order[::2]]
        number = np.empty(len(key), dtype=np.int64)
        number[order] = np.arange(len(key)) // 2
        pairs = order.reshape(-1, 2)
        corner, face = np.divmod(pairs, len(faces))
        return cls(np.column_stack(np.divmod(first, count)), face, corner, number.reshape(3, -1).T, count)

    def opposite(self, faces: Faces) -> Faces:
        """Vertices across each edge in its two faces, shape (E, 2)."""
        return faces[self.faces, (self.corners + 2) % 3]

    def valence(self) -> Faces:
        """Number of edges at each vertex, shape (V,)."""
        return np.bincount(self.ends.ravel(), minlength=self.count)

    def joined(self, a: Faces, b: Faces) -> NDArray[np.bool_]:
        """Whether vertices a (n,) and b (n,) share an edge, elementwise, shape (n,)."""
        known = self.ends[:, 0] * self.count + self.ends[:, 1]
        key = np.minimum(a, b) * self.count + np.maximum(a, b)
        place = np.minimum(np.searchsorted(known, key), len(known) - 1)
        return known[place] == key

    @cached_property
    def adjacency(self) -> csr_array:
        """Symmetric matrix with a one where two vertices share an edge, shape (V, V)."""
        a, b = self.ends.T
        ones = np.ones(2 * len(a), dtype=np.float64)
        return csr_array((ones, (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(self.count, self.count))


def dots(a: Array, b: Array) -> Array:
    """Scalar products of rows (n, 3), shape (n,); several times faster than a sum over so short an axis."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def area_normals(vertices: Array, faces: Faces) -> Array:
    """Face normals of the length of twice the area, shape (T, 3)."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def mean_over_neighbours(edges: ManifoldEdges, values: Array) -> Array:
    """Mean of per-vertex values over each vertex's neighbours, the shape of ``values``."""
    total = edges.adjacency @ values
    valence = edges.valence()
    return total / (valence if values.ndim == 1 else valence[:, None])


def subdivide(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Divide every triangle into four at the midpoints of its edges; vertices and faces."""
    edges = ManifoldEdges.of(faces, len(vertices))
    middle = vertices[edges.ends].mean(axis=1)
    ab, bc, ca = (edges.of_face + len(vertices)).T
    a, b, c = faces.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.vstack([vertices, middle]), np.stack([np.column_stack(p) for p in parts], axis=1).reshape(-1, 3)
