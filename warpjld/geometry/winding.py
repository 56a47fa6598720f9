"""Generalised winding numbers of points by direct summation of the triangles' solid angles, in float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["winding_numbers"]

_CHUNK = 60_000  # point-triangle pairs at a time: temporary arrays that stay in a processor's cache, half a MB each


def winding_numbers(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Winding numbers w = Σ Ω / 4π over all triangles, shape (n,), with solid angles Ω by the tangent formula of van
    Oosterom and Strackee (1983).

    1 inside a closed surface and 0 outside; 2 where two closed parts overlap; in between where a surface is open, such
    as a hand at its wrist.

    Args:
        vertices: Positions [m], shape (V, 3).
        faces: Triangles, anticlockwise seen from outside, shape (T, 3).
        points: Points of evaluation [m], shape (n, 3).
    """
    middle = vertices.mean(axis=0)
    vertices, points = vertices - middle, points - middle
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    # apart from its square every term is linear in the point, hence a matrix product
    normal = np.cross(a, b) + np.cross(b, c) + np.cross(c, a)
    volume = np.einsum("fk,fk->f", a, np.cross(b, c))
    out = np.empty(len(points))
    rows = max(1, _CHUNK // max(1, len(faces)))
    for start in range(0, len(points), rows):
        p = points[start : start + rows]
        square = (p * p).sum(axis=1)[:, None]
        gap = vertices[None] - p[:, None]
        la, lb, lc = np.moveaxis(np.sqrt((gap * gap).sum(axis=2))[:, faces], 2, 0)
        ab, bc, ca = (np.einsum("fk,fk->f", x, y) - p @ (x + y).T + square for x, y in ((a, b), (b, c), (c, a)))
        solid = np.arctan2(volume - p @ normal.T, la * lb * lc + ab * lc + bc * la + ca * lb)
        out[start : start + rows] = solid.sum(axis=1) / (2.0 * np.pi)
    return out
