"""Pseudonormals of triangles, edges and vertices: the sign of the distance at a closest point (Bærentzen & Aanæs)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.grasp.edges import edges_of_sides

__all__ = ["face_normals", "feature_normals"]


def face_normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals of triangles with corners (t, 3, 3), shape (t, 3); zero where there is no area."""
    return unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def feature_normals(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Pseudonormals of every triangle, of its edges opposite to corner 0, 1, 2, and of its corners, shape (t, 7, 3).

    An edge has the sum of the normals of its triangles, a corner their angle-weighted sum (Bærentzen & Aanæs 2005).
    Not normalised except those of triangles. Degenerate triangles have zero normals and contribute nothing.
    """
    corner = vertices[faces]
    normal = face_normals(corner)
    out = np.empty((len(faces), 7, 3))
    out[:, 0] = normal
    edges, place, _ = edges_of_sides(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2))
    total = np.zeros((len(edges), 3))
    np.add.at(total, place, np.repeat(normal, 3, axis=0))
    out[:, 1:4] = total[place.reshape(-1, 3)]
    at_corner = np.zeros((len(vertices), 3))
    for k in range(3):
        to_next, to_last = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
        sine = np.linalg.norm(np.cross(to_next, to_last), axis=1)
        angle = np.arctan2(sine, (to_next * to_last).sum(axis=1))
        np.add.at(at_corner, faces[:, k], angle[:, None] * normal)
    out[:, 4:] = at_corner[faces]
    return out
