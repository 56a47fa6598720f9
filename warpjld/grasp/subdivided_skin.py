"""Midpoint subdivision of a skin: more sample points on the same triangles, for contact areas on coarse skins."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.device import array_on
from warpjld.grasp.edges import edges_of_sides

__all__ = ["FinerSkin"]

_MOST = 3  # largest number of subdivisions; each makes four triangles of one


class FinerSkin:
    """Subdivision of a skin at edge midpoints until the median edge at rest is shorter than ``spacing``.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        spacing: Wanted edge length [m]; infinite leaves the skin as it is.

    Attributes:
        faces: Subdivided triangles, shape (T·4ᵏ, 3) after k subdivisions.
        parents: For every fine point a vertex of the original skin next to it, shape (n,).
    """

    def __init__(self, vertices: NDArray[np.floating], faces: NDArray[np.int32], spacing: float) -> None:
        edge = float(np.median(np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1)))
        rounds = int(np.clip(np.ceil(np.log2(edge / spacing)), 0, _MOST)) if spacing < edge else 0
        self.faces, self.parents = faces.astype(np.int32), np.arange(len(vertices))
        self._middles: list[NDArray[np.integer]] = []
        for _ in range(rounds):
            edges, place, _ = edges_of_sides(self.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
            a, b, c = self.faces.T
            ab, bc, ca = (place.reshape(-1, 3) + len(self.parents)).T
            cut = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
            self.faces = np.concatenate([np.stack(t, axis=1) for t in cut]).astype(np.int32)
            self.parents = np.concatenate([self.parents, self.parents[edges[:, 0]]])
            self._middles.append(edges)

        own = np.concatenate([faces[:, [0, 1, 2]].ravel(), faces[:, [1, 2, 0]].ravel()])
        others = np.concatenate([faces[:, [1, 2, 0]].ravel(), faces[:, [0, 1, 2]].ravel()])
        order = np.argsort(own, kind="stable")
        self._others, self._first_other = others[order], np.searchsorted(own[order], np.arange(len(vertices) + 1))
        order = np.argsort(self.faces.ravel(), kind="stable")
        self._around = order // 3
        self._first = np.searchsorted(self.faces.ravel()[order], np.arange(len(self.parents) + 1))

    def points(self, vertices: NDArray[np.floating]) -> NDArray[np.float32]:
        """Finer points of deformed skins (…, V, 3) [m], shape (…, n, 3)."""
        coarse = np.asarray(vertices, dtype=np.float32)
        out = np.empty((*coarse.shape[:-2], len(self.parents), 3), dtype=np.float32)
        done = coarse.shape[-2]
        out[..., :done, :] = coarse
        for edges in self._middles:
            middles = out[..., done : done + len(edges), :]
            np.add(out[..., edges[:, 0], :], out[..., edges[:, 1], :], out=middles)
            middles *= np.float32(0.5)
            done += len(edges)
        return out

    @cached_property
    def beside(self) -> tuple[Any, Any]:
        """Neighbours of every vertex of the original skin, as Warp arrays: where those of each begin, and all of them.

        A fine point is no farther from its parent than the longest edge there.
        """
        import warp as wp

        return array_on("cpu", self._first_other, wp.int32), array_on("cpu", self._others, wp.int32)

    def faces_around(self, points: NDArray[np.integer]) -> NDArray[np.int64]:
        """Sorted indices of the triangles with a corner among ``points``."""
        counts = self._first[points + 1] - self._first[points]
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return np.unique(self._around[np.repeat(self._first[points], counts) + within])
