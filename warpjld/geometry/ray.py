"""First triangle that a ray hits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["ray_hit"]

Array = NDArray[np.float64]


def ray_hit(corners: Array, origin: Array, direction: Array) -> tuple[float, int] | None:
    """Ray parameter t > 0 and triangle of the first hit at ``origin + t direction``, from either side; None if none.

    Möller & Trumbore 1997, "Fast, minimum storage ray-triangle intersection".

    Args:
        corners: Corners of triangles [m], shape (T, 3, 3).
        origin: Origin of the ray [m], shape (3,).
        direction: Direction of the ray, of any length, shape (3,).
    """
    a, edge, other = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(direction, other)
    determinant = np.einsum("ij,ij->i", edge, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_a = origin - a
        u = np.einsum("ij,ij->i", from_a, across) / determinant
        q = np.cross(from_a, edge)
        v = (q @ direction) / determinant
        t = np.einsum("ij,ij->i", other, q) / determinant
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0)
    if not inside.any():
        return None
    face = int(np.argmin(np.where(inside, t, np.inf)))
    return float(t[face]), face
