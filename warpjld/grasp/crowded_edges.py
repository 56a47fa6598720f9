"""Edges of more than two triangles: which of these belong together, and pieces that have no vertex in common."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.grasp.edges import edges_of_sides

__all__ = ["pairs_round_edge", "separate_pieces", "turned_patches"]

_SAME = 1e-6  # angle about an edge below which triangles lie on one another [rad]
_STEP = 1e-4  # off a triangle to either side, as a part of the root of twice its area
_RAY = np.array([0.48, 0.64, 0.6])  # the direction of a unit vector along which nobody builds


def pairs_round_edge(
    low: NDArray[np.float64], high: NDArray[np.float64], opposite: NDArray[np.float64], forward: NDArray[np.bool_]
) -> list[tuple[int, int]]:
    """Pairs of the triangles round one edge that enclose a part of a solid between them.

    Gone round about the edge anticlockwise, a triangle that runs along it from ``low`` to ``high`` has the solid before
    it, the others behind; every one of the first kind takes the nearest of the second that is still free. Triangles
    that are left over, as where a wall stands inside, are in no pair.

    Args:
        low: One end of the edge, shape (3,); likewise ``high``.
        opposite: The corner of each of n triangles that is not on the edge, shape (n, 3).
        forward: Whether they run from ``low`` to ``high``, shape (n,).
    """
    axis = unit(high - low)
    across = unit(np.cross(axis, np.eye(3)[np.abs(axis).argmin()]))
    away = opposite - low
    angle = np.arctan2(away @ np.cross(axis, across), away @ across)
    # of triangles that lie on one another, those that end a solid come first
    order = np.lexsort([~forward, np.round(angle / _SAME)])
    pairs: list[tuple[int, int]] = []
    begun: list[int] = []
    for n in [*order, *order]:  # twice round: a solid may begin before the first
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
    """Vertices that several pieces have in common, once for each of them.

    Args:
        vertices: Shape (V, 3).
        faces: Triangles, shape (T, 3).
        piece: Piece of every triangle, shape (T,).

    Returns:
        Vertices, faces, and the vertex before of every vertex.
    """
    rows = np.stack([np.repeat(piece, 3).astype(np.int64), faces.ravel().astype(np.int64)], axis=1)
    own, place = np.unique(rows, axis=0, return_inverse=True)
    return vertices[own[:, 1]], place.reshape(faces.shape).astype(np.int32), own[:, 1]


def turned_patches(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], patch: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """Patches between crowded edges that look into the solid they bound, shape (patches,).

    On which side of a patch the solid is says the number of surfaces that a ray meets, whichever way these look. Where
    it is on both, as of two lids that lie on one another, a patch is turned if its edges then fit their neighbours
    better: as many triangles run along an edge in the one direction as in the other.
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
    """Triangles (T, 3, 3) that a ray from a point meets (Möller & Trumbore 1997)."""
    a, one, other = corner[:, 0], corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(_RAY, other)
    scale = (one * across).sum(axis=1)
    scale = np.where(scale == 0.0, np.inf, scale)  # a ray in the plane of a triangle does not meet it
    u = ((point - a) * across).sum(axis=1) / scale
    turn = np.cross(point - a, one)
    v, far = (turn * _RAY).sum(axis=1) / scale, (other * turn).sum(axis=1) / scale
    return int(((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 0.0) & np.isfinite(scale)).sum())
