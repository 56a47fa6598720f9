"""Splitting of a mesh along its sharp edges, so that smooth shading does not interpolate normals across them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from warpjld.geometry.normals import vertex_normals

__all__ = ["Shading"]


class Shading:
    """A copy of a mesh whose vertices are duplicated along creases; made once, used for every frame.

    Args:
        vertices: Positions by which creases are found [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        angle: Dihedral angle [rad] above which an edge is a crease.

    Attributes:
        faces: Triangles over the split vertices, shape (T, 3).
        origin: Vertex of the mesh that each split vertex was made from, shape (n,).
    """

    def __init__(self, vertices: NDArray[np.floating], faces: NDArray[np.integer], angle: float) -> None:
        a, b, c = (vertices[faces[:, corner]] for corner in range(3))
        normals = np.cross(b - a, c - a)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        corners = np.arange(3 * len(faces)).reshape(-1, 3)
        # match each directed edge with the opposite one of the neighbouring face
        tails, heads = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
        flat = faces.ravel().astype(np.int64)
        count = int(flat.max()) + 1
        forth, back = flat[tails] * count + flat[heads], flat[heads] * count + flat[tails]
        order = np.argsort(forth)
        place = order[np.minimum(np.searchsorted(forth, back, sorter=order), len(order) - 1)]
        smooth = (forth[place] == back) & (
            np.einsum("ij,ij->i", normals[tails // 3], normals[place // 3]) > np.cos(angle)
        )
        ones = np.concatenate([tails[smooth], heads[smooth]])
        others = np.concatenate([heads[place[smooth]], tails[place[smooth]]])
        links = coo_array((np.ones(len(ones)), (ones, others)), shape=(len(flat),) * 2)
        label = connected_components(links, directed=False)[1]
        kept, first = np.unique(label, return_index=True)
        self.origin = flat[first]
        self.faces = label.reshape(-1, 3).astype(np.int32)
        assert len(kept) == label.max() + 1

    def place(self, vertices: NDArray[np.floating]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Positions and normals of the split vertices, shape (n, 3) each, from positions of the mesh's."""
        points = vertices[self.origin]
        return points.astype(np.float32), vertex_normals(points, self.faces)
