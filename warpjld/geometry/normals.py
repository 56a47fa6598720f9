"""Vertex normals of a triangulated surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["vertex_normals"]


def vertex_normals(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> NDArray[np.float32]:
    """Unit vertex normals: area-weighted mean of the adjacent faces' normals.

    Args:
        vertices: Positions, shape (V, 3). Weld texture seams first, or they show as edges.
        faces: Triangles, shape (T, 3), anticlockwise seen from outside.

    Returns:
        Normals, shape (V, 3); +Z for a vertex without adjacent area, so that no normal is zero.
    """
    a, b, c = (np.asarray(vertices, np.float64)[faces[:, corner]] for corner in range(3))
    weighted = np.cross(b - a, c - a)
    corners = np.ravel(faces, order="F")
    total = np.stack(
        [np.bincount(corners, np.tile(weighted[:, axis], 3), minlength=len(vertices)) for axis in range(3)], axis=1
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    flat = length[:, 0] <= np.finfo(np.float64).tiny
    total[flat], length[flat] = (0.0, 0.0, 1.0), 1.0
    return (total / length).astype(np.float32)
