"""Smoothing of fields on visible surfaces, which hides the gradient jumps at element boundaries."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["SurfaceSmoother"]

_LENGTH = 1.0
"""Smoothing length, in element edges."""
_MOST = 12
"""Most smoothing steps."""


class SurfaceSmoother:
    """Umbrella (mean over neighbours) smoothing over about one element edge.

    Args:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        edge: Element edge [m]; a surface coarser than the elements is not smoothed.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.integer], edge: float) -> None:
        from scipy.sparse import csr_array, diags_array

        ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        length = float(np.median(np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)))
        # the variance of a step (1 + mean) / 2 is half an edge squared
        self.steps = min(_MOST, int(2.0 * (_LENGTH * edge / max(length, 1e-300)) ** 2))
        count = len(vertices)
        table = csr_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
        links = ((table + table.T) > 0).astype(float)
        self._mean: Any = diags_array(1.0 / np.maximum(links.sum(axis=1), 1.0)) @ links

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Smoothed values at the vertices, shape (V,) or (V, n)."""
        for _ in range(self.steps):
            values = 0.5 * (values + self._mean @ values)
        return values
