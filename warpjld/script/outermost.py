"""Reduction of a point set to the corners of its convex hull, for framing cameras."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

__all__ = ["outermost"]


def outermost(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners of the convex hull of points (n, 3); of their bounding box where the points are degenerate."""
    if len(points) <= 4:
        return points
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:  # coplanar, collinear or coincident points
        low, high = points.min(axis=0), points.max(axis=0)
        corners = np.stack(np.meshgrid(*([0.0, 1.0],) * 3), axis=-1).reshape(-1, 3)
        return np.asarray(low + corners * (high - low))
