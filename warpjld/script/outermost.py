"""Points that decide what a camera must show: the corners of all points' convex hull."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

__all__ = ["outermost"]


def outermost(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Some of the points (n, 3), whose convex hull is that of all."""
    if len(points) <= 4:
        return points
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:  # in a plane, on a line, or in one place: the corners of a box around them
        low, high = points.min(axis=0), points.max(axis=0)
        corners = np.stack(np.meshgrid(*([0.0, 1.0],) * 3), axis=-1).reshape(-1, 3)
        return np.asarray(low + corners * (high - low))
