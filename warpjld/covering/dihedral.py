"""Dihedral angles at the edges of a surface, and their derivatives by the vertices' positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["dihedral_angles", "dihedral_slopes", "hinges"]


def hinges(faces: NDArray[np.integer]) -> NDArray[np.int64]:
    """Interior edges with their two faces: vertices i, j of the edge, and k, m opposite to it in the faces (i, j, k)
    and (j, i, m), shape (H, 4). Edges of a single face, and of faces of opposite orientation, are left out."""
    count = int(faces.max(initial=-1)) + 1
    half = np.concatenate([faces[:, [0, 1, 2]], faces[:, [1, 2, 0]], faces[:, [2, 0, 1]]]).astype(np.int64)
    key, back = half[:, 0] * count + half[:, 1], half[:, 1] * count + half[:, 0]
    order = np.argsort(key, kind="stable")
    place = np.minimum(np.searchsorted(key[order], back), max(len(order) - 1, 0))
    partner = order[place]
    found = (key[partner] == back) & (half[:, 0] < half[:, 1])
    return np.column_stack([half[found], half[partner[found], 2]])


def dihedral_angles(points: NDArray[np.float64], hinge: NDArray[np.int64]) -> NDArray[np.float64]:
    """Unsigned angle [rad] between the normals of the two faces of each hinge, 0 where flat, shape (H,)."""
    first, second = _normals(points, hinge)
    across = _cross(first, second)
    return np.asarray(np.arctan2(np.sqrt(_dot(across, across)), _dot(first, second)))


def dihedral_slopes(
    points: NDArray[np.float64], hinge: NDArray[np.int64], least: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Derivatives of the dihedral angles by the positions of i, j, k and m [rad/m], shape (H, 4, 3).

    Args:
        points: Positions [m], shape (V, 3).
        hinge: From :func:`hinges`.
        least: Lower bounds of the two faces' doubled areas as divisors [m²], shape (H, 2).
    """
    first, second = _normals(points, hinge)
    i, j, k, m = (points[hinge[:, n]] for n in range(4))
    along = j - i
    length = np.maximum(np.sqrt(_dot(along, along)), 1e-30)[:, None]
    # a face turns about the edge by the motion of its corner along the normal over its height, height = |n| / length
    a = first / np.maximum(_dot(first, first), least[:, 0] ** 2)[:, None]
    b = second / np.maximum(_dot(second, second), least[:, 1] ** 2)[:, None]
    sign = np.where(_dot(_cross(first, second), along) > 0.0, -1.0, 1.0)[:, None]

    def share(corner: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        return _dot(corner - end, along)[:, None] / length

    by_i = share(k, j) * a + share(m, j) * b
    by_j = -share(k, i) * a - share(m, i) * b
    return np.stack([sign * s for s in (by_i, by_j, length * a, length * b)], axis=1)


def _normals(points: NDArray[np.float64], hinge: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normals of both faces of each hinge, of twice the faces' areas [m²], shape (H, 3) each."""
    i, j, k, m = (points[hinge[:, n]] for n in range(4))
    along = j - i
    return _cross(along, k - i), _cross(m - i, along)


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cross products of rows; far faster than NumPy's for many short arrays."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.column_stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.einsum("ij,ij->i", a, b))
