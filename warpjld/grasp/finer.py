"""A skin with more points on the same triangles, for measures that its own vertices are too far apart for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["FinerSkin"]

_MOST = 3  # rounds: every one makes four triangles of one


class FinerSkin:
    """Triangles cut at the middles of their edges until the median edge at rest is shorter than asked for.

    Args:
        vertices: At rest [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        spacing: Length asked for [m].

    Attributes:
        faces: Finer triangles, shape (T·4ⁿ, 3).
        parents: A vertex of the skin beside every finer one, shape (n,).
    """

    def __init__(self, vertices: NDArray[np.floating], faces: NDArray[np.int32], spacing: float) -> None:
        edge = float(np.median(np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1)))
        rounds = int(np.clip(np.ceil(np.log2(edge / spacing)), 0, _MOST))
        self.faces, self.parents = faces.astype(np.int32), np.arange(len(vertices))
        self._middles: list[NDArray[np.integer]] = []
        for _ in range(rounds):
            corners = self.faces[:, [[0, 1], [1, 2], [2, 0]]]
            edges, place = np.unique(np.sort(corners.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
            a, b, c = self.faces.T
            ab, bc, ca = (place.reshape(-1, 3) + len(self.parents)).T
            cut = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
            self.faces = np.concatenate([np.stack(t, axis=1) for t in cut]).astype(np.int32)
            self.parents = np.concatenate([self.parents, self.parents[edges[:, 0]]])
            self._middles.append(edges)

    def points(self, vertices: NDArray[np.floating]) -> NDArray[np.float32]:
        """Finer points of a deformed skin (V, 3) [m], shape (n, 3)."""
        out = np.asarray(vertices, dtype=np.float32)
        for edges in self._middles:
            out = np.concatenate([out, 0.5 * (out[edges[:, 0]] + out[edges[:, 1]])])
        return out
