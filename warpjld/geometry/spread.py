"""Harmonic extension of vertex values over a surface to vertices that have none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
    import scipy.sparse.csgraph as csgraph
    import scipy.spatial as spatial
else:
    sp = lazy_module("scipy.sparse")
    csgraph = lazy_module("scipy.sparse.csgraph")
    spatial = lazy_module("scipy.spatial")

__all__ = ["spread"]

_STEPS = 2_000  # iteration limit
_SETTLED = 1e-9  # change in an iteration, relative to the largest value, at which it ends


def spread(
    values: NDArray[np.float64], known: NDArray[np.bool_], vertices: NDArray[np.float64], faces: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Values (V, n) whose unknown rows are means of their neighbours along edges, weighted by 1 / length.

    Vertices of connected components without any known vertex take the row of the nearest known vertex.

    Args:
        values: Rows, of which the unknown ones are ignored, shape (V, n).
        known: Which rows are known, at least one, shape (V,).
        vertices: Positions, shape (V, 3).
        faces: Triangles, shape (T, 3).
    """
    count = len(vertices)
    bare = np.flatnonzero(~known)
    if not bare.size:
        return values
    edges = np.unique(np.sort(np.concatenate([faces[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))]), axis=1), axis=0)
    edges = edges[edges[:, 0] < edges[:, 1]]
    length = np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1)
    conducted = 1.0 / np.maximum(length, 1e-9 * max(float(length.max(initial=0.0)), 1e-30))
    graph = sp.coo_array((conducted, (edges[:, 0], edges[:, 1])), shape=(count, count)).tocsr()
    graph = (graph + graph.T).tocsr()
    label = csgraph.connected_components(graph, directed=False)[1]
    reached = np.isin(label[bare], np.unique(label[known]))
    out = values.copy()
    near = np.flatnonzero(known)
    out[bare] = values[near[spatial.cKDTree(vertices[near]).query(vertices[bare])[1]]]
    inner = bare[reached]
    if inner.size:
        rows = graph[inner]
        rows = sp.diags_array(1.0 / rows.sum(axis=1)) @ rows
        fixed = rows[:, near] @ values[near]
        among = rows[:, inner].tocsr()
        x = out[inner]
        for _ in range(_STEPS):  # Jacobi iteration: unlike a direct solver it stays within the range of known values
            x, before = among @ x + fixed, x
            if np.abs(x - before).max(initial=0.0) < _SETTLED * max(float(np.abs(x).max(initial=0.0)), 1e-300):
                break
        out[inner] = x
    return out
