"""Triangulation of polygons with any number of corners, convex or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["triangulate_polygons"]

_STRAIGHT = 1e-9
"""Largest reflex turn that counts as straight, relative to the polygon's area."""


def triangulate_polygons(
    points: NDArray[np.float64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangulate polygons, keeping their orientation.

    Convex polygons are split into the fan of their first corner, concave ones by VTK's ear clipping.

    Args:
        points: Positions of all polygons' corners, shape (C, 3).
        counts: Number of corners of every polygon, shape (P,), with sum C; polygons of fewer than three are skipped.

    Returns:
        Corners of every triangle, as rows of ``points``, shape (S, 3), and its polygon, shape (S,); in the polygons'
        order.
    """
    counts = np.asarray(counts, dtype=np.int64)
    starts = np.cumsum(counts) - counts
    triangles, owners = [np.zeros((0, 3), dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for count in np.unique(counts[counts >= 3]):
        polygons = np.flatnonzero(counts == count)
        corners = starts[polygons, None] + np.arange(count)
        convex = np.ones(len(polygons), dtype=bool) if count == 3 else _convex(points[corners])
        steps = np.arange(1, count - 1)
        fan = np.stack([np.zeros_like(steps), steps, steps + 1], axis=1)
        triangles.append(corners[convex][:, fan].reshape(-1, 3))
        owners.append(np.repeat(polygons[convex], count - 2))
        if not convex.all():
            cut, owner = _clip_ears(points[corners[~convex]], fan)
            triangles.append(corners[~convex][owner[:, None], cut])
            owners.append(polygons[~convex][owner])
    order = np.argsort(np.concatenate(owners), kind="stable")
    return np.concatenate(triangles)[order], np.concatenate(owners)[order]


def _convex(polygons: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask of convex polygons, shape (P,), for polygons (P, n, 3)."""
    edges = np.roll(polygons, -1, axis=1) - polygons
    normal = np.cross(polygons - polygons[:, :1], np.roll(polygons, -1, axis=1) - polygons[:, :1]).sum(axis=1)  # Newell
    turns = np.einsum("pnk,pk->pn", np.cross(np.roll(edges, 1, axis=1), edges), normal)
    return np.asarray((turns >= -_STRAIGHT * np.einsum("pk,pk->p", normal, normal)[:, None]).all(axis=1))


def _clip_ears(polygons: NDArray[np.float64], fan: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles as corner indices 0…n-1, and the polygon of each, for polygons (P, n, 3)."""
    import pyvista

    number, count = polygons.shape[:2]
    cells = np.column_stack([np.full(number, count), np.arange(number * count).reshape(number, count)])
    mesh = pyvista.PolyData(polygons.reshape(-1, 3), cells.ravel()).triangulate()
    corners = np.asarray(mesh.faces, dtype=np.int64).reshape(-1, 4)[:, 1:]
    owner = corners[:, 0] // count
    missing = np.setdiff1d(np.arange(number), owner)  # self-intersecting, without an ear: use the fan
    corners = np.concatenate([corners % count, np.tile(fan, (len(missing), 1))])
    return corners, np.concatenate([owner, np.repeat(missing, len(fan))])
