"""Edges of a triangulated surface, classified by whether they face the camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Edges"]


class Edges:
    """Unique edges of triangles (T, 3).

    Attributes:
        ends: Vertices of each edge, shape (E, 2).
    """

    def __init__(self, faces: NDArray[np.integer]) -> None:
        self._faces = faces
        sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        count = int(faces.max()) + 1
        keys, edge = np.unique(sides[:, 0].astype(np.int64) * count + sides[:, 1], return_inverse=True)
        self.ends = np.stack(np.divmod(keys, count), axis=1)
        owner = np.repeat(np.arange(len(faces)), 3)
        # first and last face at each edge, which are the same at a boundary
        self._first = np.empty(len(self.ends), np.int64)
        self._last = np.empty(len(self.ends), np.int64)
        self._first[edge[::-1]] = owner[::-1]
        self._last[edge] = owner

    def facing(self, vertices: NDArray[np.floating], eye: tuple[float, float, float]) -> NDArray[np.bool_]:
        """Whether a face at the edge is front-facing as seen from the eye [m], shape (E,)."""
        a, b, c = (vertices[self._faces[:, corner]] for corner in range(3))
        front = np.einsum("ij,ij->i", np.cross(b - a, c - a), np.asarray(eye) - a) > 0
        return front[self._first] | front[self._last]
