"""Non-manifold edges: pairing of the triangles around them, and separation of a surface into pieces there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.grasp.edges import edges_of_sides

__all__ = ["pairs_round_edge", "separate_pieces", "turned_patches"]

_SAME = 1e-6  # dihedral angle below which two triangles coincide [rad]
_STEP = 1e-4  # offset of a ray's origin from a triangle, relative to the square root of twice the triangle's area
_RAY = np.array([0.48, 0.64, 0.6])  # unit ray direction, unlikely to be parallel to modelled faces


def pairs_round_edge(
    low: NDArray[np.float64], high: NDArray[np.float64], opposite: NDArray[np.float64], forward: NDArray[np.bool_]
) -> list[tuple[int, int]]:
    """Pair the triangles around an edge so that each pair bounds one wedge of a solid.

    Triangles are sorted by angle about the edge, anticlockwise. One that traverses the edge from ``low`` to ``high``
    ends a wedge of the solid, the others begin one; each end is paired with the nearest beginning before it that is
    still free. Triangles left over, such as an internal wall, are in no pair.

    Args:
        low: One end of the edge, shape (3,); likewise ``high``.
        opposite: The corner of each of n triangles that is not on the edge, shape (n, 3).
        forward: Whether each traverses the edge from ``low`` to ``high``, shape (n,).

    Returns:
        Pairs of rows, the triangle that begins a wedge first.
    """
    axis = unit(high - low)
    across = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin()]))
    away = opposite - low
    angle = np.arctan2(away @ np.cross(axis, across), away @ across)
    # of triangles that coincide, those that end a wedge come first
    order = np.lexsort([~forward, np.round(angle / _SAME)])
    pairs: list[tuple[int, int]] = []
    begun: list[int] = []
    for n in [*order, *order]:  # twice round: a wedge may begin before the first triangle
        n = int(n)
        if any(n in pair for pair in pairs):
            continue
        if not forward[n]:
            if n not in begun:
                begun.append(n)
        elif begun:
            pairs.append((begun.pop(), n))
    return pairs


def separate_pieces(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], piece: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int64]]:
    """Duplicate vertices that several pieces share, so that every piece has its own.

    Args:
        vertices: Shape (V, 3).
        faces: Triangles, shape (T, 3).
        piece: Piece of every triangle, shape (T,).

    Returns:
        Vertices, faces, and the original index of every vertex.
    """
    rows = np.stack([np.repeat(piece, 3).astype(np.int64), faces.ravel().astype(np.int64)], axis=1)
    own, place = np.unique(rows, axis=0, return_inverse=True)
    return vertices[own[:, 1]], place.reshape(faces.shape).astype(np.int32), own[:, 1]


def turned_patches(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], patch: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """Find patches (bounded by non-manifold edges) whose normals point into the solid they bound.

    The side of the solid is found by ray parity (number of triangles a ray from either side of the patch crosses),
    which does not depend on orientation. Where parity says solid on both sides or on neither, as between two coinciding
    lids, a patch is flipped if this balances its edges better: every edge should be traversed equally often in both
    directions.

    Args:
        vertices: Shape (V, 3).
        faces: Triangles, shape (T, 3).
        patch: Patch of every triangle, shape (T,).

    Returns:
        Mask of the patches to flip, shape (patches,).
    """
    count = int(patch.max()) + 1
    turned, doubtful = np.zeros(count, dtype=bool), []
    corner = vertices[faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    for k in range(count):
        own = np.flatnonzero(patch == k)
        face = int(own[area[own].argmax()])
        middle, step = corner[face].mean(axis=0), _STEP * np.sqrt(area[face]) * normal[face] / area[face]
        before, behind = (_crossings(corner, middle + side * step) % 2 == 1 for side in (1.0, -1.0))
        turned[k] = before and not behind
        if before == behind:
            doubtful.append(k)
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, edge, _ = edges_of_sides(ends)
    along = np.where(ends[:, 0] < ends[:, 1], 1, -1)
    owner = np.repeat(patch, 3)
    for k in doubtful:
        own = owner == k
        run = np.bincount(edge, along * np.where(turned[owner], -1, 1))
        its = np.bincount(edge[own], along[own], minlength=len(run))
        turned[k] = np.abs(run - 2.0 * its).sum() < np.abs(run).sum()
    return turned


def _crossings(corner: NDArray[np.float64], point: NDArray[np.float64]) -> int:
    """Number of triangles (T, 3, 3) that the ray from a point along ``_RAY`` crosses (Möller & Trumbore 1997)."""
    a, one, other = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(_RAY, other)
    scale = (one * across).sum(axis=1)
    scale = np.where(scale == 0.0, np.inf, scale)  # a ray in the plane of a triangle does not meet it
    u = ((point - a) * across).sum(axis=1) / scale
    turn = np.cross(point - a, one)
    v, far = (turn * _RAY).sum(axis=1) / scale, (other * turn).sum(axis=1) / scale
    return int(((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 0.0) & np.isfinite(scale)).sum())
