"""Polygons of any number of corners, convex or not → triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["triangulate"]

_CONVEX = -1e-9
"""Sine, as areas, from which a corner counts as one that turns inwards."""


def triangulate(points: NDArray[np.float64], corners: ArrayLike, counts: ArrayLike) -> NDArray[np.int64]:
    """Triangles of polygons, as numbers of corners, shape (S, 3); polygon after polygon, with their winding.

    Convex polygons become a fan about their first corner; others lose one ear after the other. Polygons of fewer than
    three corners are left out.

    Args:
        points: Vertices, shape (W, 3).
        corners: Vertex of every corner, shape (C,).
        counts: Corners of every polygon, shape (P,), adding up to C.
    """
    corners, counts = np.asarray(corners, dtype=np.int64), np.asarray(counts, dtype=np.int64)
    starts = np.cumsum(counts) - counts
    order, triangles = [], []
    for count in np.unique(counts[counts >= 3]):
        which = np.flatnonzero(counts == count)
        local = np.arange(count)
        mine = starts[which][:, None] + local
        fan = np.stack([np.zeros(count - 2, np.int64), local[1:-1], local[2:]], axis=1)
        found = np.tile(fan, (len(which), 1, 1))
        if count > 3:
            outlines = points[corners[mine]]
            for p in np.flatnonzero(~_convex(outlines)):
                found[p] = _ears(outlines[p], fan)
        order.append(np.repeat(which, count - 2))
        triangles.append((mine[:, :1, None] + found).reshape(-1, 3))
    if not triangles:
        return np.zeros((0, 3), np.int64)
    return np.concatenate(triangles)[np.argsort(np.concatenate(order), kind="stable")]


def _convex(outlines: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether no corner turns inwards, of P polygons of one size, shape (P, n, 3)."""
    ahead = np.roll(outlines, -1, axis=1)
    normals = np.cross(outlines, ahead).sum(axis=1)  # Newell: twice the area
    turns = np.cross(ahead - outlines, np.roll(ahead, -1, axis=1) - ahead)
    size = np.square(ahead - outlines).sum(axis=2).max(axis=1)
    inward = np.einsum("pna,pa->pn", turns, normals) < _CONVEX * (size * np.linalg.norm(normals, axis=1))[:, None]
    return np.asarray(~inward.any(axis=1))


def _ears(outline: NDArray[np.float64], fan: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles of one polygon, shape (n - 2, 3); a fan where it crosses itself."""
    from vtkmodules.vtkCommonCore import vtkIdList
    from vtkmodules.vtkCommonDataModel import vtkPolygon

    polygon = vtkPolygon()
    centred = outline - outline.mean(axis=0)
    for n, point in enumerate(centred / max(np.abs(centred).max(), 1e-300)):
        polygon.GetPointIds().InsertNextId(n)
        polygon.GetPoints().InsertNextPoint(point)
    ids = vtkIdList()
    good = polygon.TriangulateLocalIds(0, ids)
    if not good or ids.GetNumberOfIds() != fan.size:
        return fan
    triangles = np.array([ids.GetId(i) for i in range(fan.size)]).reshape(-1, 3)
    return _as_wound(triangles, outline)


def _as_wound(triangles: NDArray[np.int64], outline: NDArray[np.float64]) -> NDArray[np.int64]:
    """The same triangles, each turning the way its polygon does."""
    normal = np.cross(outline, np.roll(outline, -1, axis=0)).sum(axis=0)
    a, b, c = outline[triangles].swapaxes(0, 1)
    back = np.cross(b - a, c - a) @ normal < 0.0
    return np.where(back[:, None], triangles[:, ::-1], triangles)
