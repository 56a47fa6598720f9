"""Distances along the edges of a triangulated surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

__all__ = ["edge_distance", "edge_graph"]


def edge_graph(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> csr_array:
    """Lengths of the edges of triangles (T, 3) between vertices (V, 3) [m], shape (V, V)."""
    from scipy.sparse import coo_array

    count = len(vertices)
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    one, other = np.divmod(np.unique(sides @ [count, 1]), count)
    length = np.linalg.norm(vertices[one] - vertices[other], axis=1)
    return coo_array((length + 1e-12, (one, other)), shape=(count, count)).tocsr()


def edge_distance(graph: csr_array, start: NDArray[np.bool_], limit: float) -> NDArray[np.float64]:
    """Distance along edges to the nearest vertex of a mask [m], infinite beyond ``limit``, shape (V,).

    Args:
        graph: Lengths of edges (:func:`edge_graph`).
        start: Mask of vertices, shape (V,).
        limit: Largest distance that is looked for [m].
    """
    from scipy.sparse.csgraph import dijkstra

    distance = dijkstra(graph, directed=False, indices=np.flatnonzero(start), limit=limit, min_only=True)
    return np.asarray(distance, np.float64)
