"""Winding numbers in float64: how often a surface goes round a point, by summing every triangle's solid angle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["winding_numbers"]

_CHUNK = 2_000_000  # point-triangle pairs at a time, which bounds memory


def winding_numbers(
    points: NDArray[np.float64], vertices: NDArray[np.float64], faces: NDArray[np.int32]
) -> NDArray[np.float64]:
    """w = Σ Ω / 4π over all triangles, Ω by the tangent formula of van Oosterom and Strackee (1983), shape (n,).

    1 inside a closed surface and 0 outside; 2 where two closed parts overlap; between where a surface is open.

    Args:
        points: Where [m], shape (n, 3).
        vertices: Positions [m], shape (V, 3).
        faces: Triangles, anticlockwise seen from outside, shape (T, 3).
    """
    corners = vertices[faces]
    out = np.empty(len(points))
    step = max(1, _CHUNK // max(len(faces), 1))
    for start in range(0, len(points), step):
        some = points[start : start + step]
        a, b, c = (corners[None, :, k] - some[:, None] for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        top = (a * np.cross(b, c)).sum(axis=2)
        bottom = la * lb * lc + (a * b).sum(2) * lc + (b * c).sum(2) * la + (c * a).sum(2) * lb
        out[start : start + step] = np.arctan2(top, bottom).sum(axis=1) / (2.0 * np.pi)
    return out
