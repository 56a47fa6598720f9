"""Smoothing of fields on visible surfaces, which hides the gradient jumps at element boundaries."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["SurfaceSmoother"]

_SPREAD = 0.25
"""Time of diffusion, in squares of an element's edge: a spike spreads by a standard deviation of 0.7 edges per axis."""
_STEPS = 2
"""Implicit steps of the diffusion; one would leave a cusp at a spike."""


class SurfaceSmoother:
    """Diffusion over about one element edge.

    Weights are cotangents: unlike means over neighbours, they leave fields alone that vary linearly along the surface,
    however unequal the triangles are. Means would drag the vertices of slivers across each other.

    Args:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        edge: Element edge [m]; a surface coarser than the elements is not smoothed.
    """

    def __init__(self, vertices: NDArray[np.float64], faces: NDArray[np.integer], edge: float) -> None:
        from scipy.sparse import diags_array

        from warpjld.covering.heat import DiffusionFactor
        from warpjld.covering.laplacian import surface_laplacian

        ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        length = float(np.median(np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)))
        self._factor: DiffusionFactor | None = None
        if 2.0 * edge * edge >= length * length:
            laplacian, self._area = surface_laplacian(vertices, faces.astype(np.int32))
            step = _SPREAD * edge * edge / _STEPS
            self._factor = DiffusionFactor(diags_array(self._area) + step * laplacian)

    def of(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Smoothed values at the vertices, shape (V,) or (V, n)."""
        if self._factor is None:
            return values
        columns = values.reshape(len(values), -1)
        return self._factor.solve(columns, weight=self._area, times=_STEPS).reshape(values.shape)
