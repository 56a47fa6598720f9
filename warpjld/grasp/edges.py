"""Unique edges of a triangle mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["edges_of_sides"]


def edges_of_sides(
    sides: NDArray[np.integer],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Unique undirected edges; the result of ``np.unique(axis=0)``, but faster, on combined integer keys.

    Args:
        sides: Vertex indices at the ends of the triangles' sides, shape (n, 2).

    Returns:
        Edges in ascending order, the lower vertex first, shape (E, 2); edge of every side, shape (n,); number of sides
        of every edge, shape (E,).
    """
    low, high = np.minimum(sides[:, 0], sides[:, 1]), np.maximum(sides[:, 0], sides[:, 1])
    most = int(high.max(initial=0)) + 1
    key, place, uses = np.unique(low.astype(np.int64) * most + high, return_inverse=True, return_counts=True)
    return np.stack([key // most, key % most], axis=1), place, uses
