"""Distances along the edges of a triangulated surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["edge_distance"]


def edge_distance(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], start: NDArray[np.bool_], limit: float
) -> NDArray[np.float64]:
    """Distance along edges to the nearest vertex of a mask [m], infinite beyond ``limit``, shape (V,).

    Args:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        start: Mask of vertices, shape (V,).
        limit: Largest distance that is looked for [m].
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    count = len(vertices)
    graph = coo_array((length + 1e-12, (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    distance = dijkstra(graph, directed=False, indices=np.flatnonzero(start), limit=limit, min_only=True)
    return np.asarray(distance, np.float64)
