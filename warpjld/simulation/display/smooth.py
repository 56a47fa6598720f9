"""Fields on visible surfaces without the kinks of elements: between elements gradients jump, and the eye sees it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["SurfaceSmoother"]

_LENGTH = 1.0
"""How far values spread, in edges of elements."""
_MOST = 12


class SurfaceSmoother:
    """Averages over neighbouring vertices, as often as it takes to spread over an element.

    Args:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        edge: Of the elements [m]. A surface that is coarser than they are is left alone.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.integer], edge: float) -> None:
        from scipy.sparse import csr_array, diags_array

        ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        length = float(np.median(np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)))
        # a step of (1 + mean) / 2 spreads by half an edge squared
        self.steps = min(_MOST, int(2.0 * (_LENGTH * edge / max(length, 1e-300)) ** 2))
        count = len(vertices)
        table = csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
        links = ((table + table.T) > 0).astype(float)
        self._mean: Any = diags_array(1.0 / np.maximum(links.sum(axis=1), 1.0)) @ links

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Smoother values of vertices, shape (V,) or (V, n)."""
        for _ in range(self.steps):
            values = 0.5 * (values + self._mean @ values)
        return values
