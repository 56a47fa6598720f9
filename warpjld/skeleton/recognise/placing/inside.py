"""Points inside a surface that may be open at its ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.coincident import connected_parts
from warpjld.geometry.winding import winding_numbers

__all__ = ["held_inside", "open_ends", "outside_surface"]


def open_ends(vertices: NDArray[np.float64], faces: NDArray[np.integer]) -> list[tuple[NDArray[np.float64], float]]:
    """Centre and radius of every boundary loop: wrists may be cut open there."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    rim = unique[count == 1]
    if not len(rim):
        return []
    label = connected_parts(rim, len(vertices))
    out = []
    for loop in np.unique(label[rim[:, 0]]):
        points = vertices[label == loop]
        centre = points.mean(axis=0)
        out.append((centre, float(np.linalg.norm(points - centre, axis=1).max())))
    return out


def outside_surface(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], points: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Mask of points outside a surface that may be open at its ends, shape (n,)."""
    return ~held_inside(vertices, faces, points, open_ends(vertices, faces))


def held_inside(
    vertices: NDArray[np.float64],
    faces: NDArray[np.integer],
    points: NDArray[np.float64],
    ends: list[tuple[NDArray[np.float64], float]],
) -> NDArray[np.bool_]:
    """Whether points are inside the surface, or near an open end, where the winding number fades to one half.

    Args:
        vertices: Surface [m], shape (V, 3).
        faces: Its triangles, shape (T, 3).
        points: Shape (n, 3) [m].
        ends: Of ``open_ends``.

    Returns:
        Mask, shape (n,).
    """
    if not len(points):
        return np.zeros(0, dtype=bool)
    inside = winding_numbers(vertices, faces, points) > 0.5
    for centre, radius in ends:
        inside |= np.linalg.norm(points - centre, axis=1) < 0.7 * radius
    return inside
