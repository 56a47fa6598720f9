"""Signed distance to the whole deformed boundary of a body."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpjld.fem.arrays import Array, Ints, Ints32
from warpjld.runtime.query_mesh import query_mesh

__all__ = ["Enclosure"]


class Enclosure:
    """Closed surface of quadrilaterals with signed-distance queries.

    Args:
        quads: Nodes at each face's corners, anticlockwise seen from outside, shape (F, 4).

    Attributes:
        quads: As given.
        nodes: Its nodes, ascending, shape (n,).
        low, high: Corners of its bounding box after ``move`` [m], shape (3,).
    """

    def __init__(self, quads: Ints32) -> None:
        self.quads = quads
        self.nodes, inverse = np.unique(quads, return_inverse=True)
        corners = np.asarray(inverse, dtype=np.int32).reshape(quads.shape)
        self._triangles = np.ascontiguousarray(corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
        self._mesh: Any = None

    def move(self, x: Array) -> None:
        """Set the positions of all nodes, x (N, 3) [m]."""

        here = x[self.nodes]
        self.low, self.high = here.min(axis=0), here.max(axis=0)
        self._origin, self._size = here.mean(axis=0), float(np.linalg.norm(self.high - self.low))
        local = ((here - self._origin) / self._size).astype(np.float32)
        self._mesh = query_mesh(local, self._triangles.reshape(-1, 3), winding=True)

    def ask(self, points: Array, farthest: float) -> tuple[Array, Ints]:
        """Signed distances of points (n, 3), negative inside [m], shape (n,), and their nearest faces, shape (n,).

        Points farther away than ``farthest`` [m] get that distance and face −1. Accuracy is single precision relative
        to the body's size.
        """
        import warp as wp
        from warpjld_kernels import fem_inside

        count = len(points)
        distance, face = np.full(count, farthest), np.full(count, -1, np.int64)
        near = np.flatnonzero(((points > self.low - farthest) & (points < self.high + farthest)).all(axis=1))
        if not len(near):
            return distance, face
        local = np.ascontiguousarray((points[near] - self._origin) / self._size, dtype=np.float32)
        found, triangle = np.empty(len(near), np.float32), np.empty(len(near), np.int32)
        closest = np.empty((len(near), 3), np.float32)
        outputs = [
            wp.array(found, dtype=float, device="cpu", copy=False),
            wp.array(closest, dtype=wp.vec3, device="cpu", copy=False),
            wp.array(triangle, dtype=wp.int32, device="cpu", copy=False),
        ]
        reach = max(farthest / self._size, 2.0)  # at least the whole size, so that inner points are found at any depth
        inputs = [self._mesh.id, reach, wp.array(local, dtype=wp.vec3, device="cpu")]
        wp.launch(fem_inside.signed_distance, dim=len(near), inputs=[*inputs, *outputs], device="cpu")
        distance[near] = found * self._size
        face[near] = np.where(triangle >= 0, triangle // 2, -1)
        return distance, face
