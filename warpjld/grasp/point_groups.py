"""Bounding-sphere hierarchy over points, so that kernels can skip groups that are far from a surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.grasp.triangle_tree import halved

__all__ = ["grouped_points"]

_TOGETHER = 8  # points per leaf
_HELD = 4  # children per group
_WIDER = 1.0 + 1e-12  # factor on the radii against rounding


def grouped_points(points: ArrayLike) -> Any:
    """``warpjld_kernels.points_in_skins.PointGroups`` of points (n, 3), n > 0; the points are reordered."""
    import warp as wp
    from warpjld_kernels.points_in_skins import PointGroups

    rows = np.asarray(points, dtype=np.float64)
    rows = rows[halved(rows)]
    firsts = [np.arange(0, len(rows), _TOGETHER)]
    while len(firsts[-1]) > 1:
        firsts.append(firsts[-1][::_HELD])
    ends = [np.append(first[1:], len(rows)) for first in firsts]
    # depth-first order, parents before children: by first point, larger groups first
    level = np.repeat(np.arange(len(firsts)), [len(first) for first in firsts])
    order = np.lexsort([-level, np.concatenate(firsts)])
    first, end = np.concatenate(firsts)[order], np.concatenate(ends)[order]
    after = np.searchsorted(first, end)
    middle = [_middles(rows, *span) for span in zip(firsts, ends, strict=True)]
    centre, radius = (np.concatenate(part)[order] for part in zip(*middle, strict=True))
    out = PointGroups()
    out.points, out.centre = (wp.array(a, dtype=wp.vec3d, device="cpu") for a in (rows, centre))
    out.radius = wp.array(radius, dtype=wp.float64, device="cpu")
    out.first, out.end, out.after = (
        wp.array(a.astype(np.int32), dtype=wp.int32, device="cpu") for a in (first, end, after)
    )
    return out


def _middles(
    points: NDArray[np.float64], first: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bounding spheres of k consecutive ranges of points: centres of their boxes (k, 3), and radii (k,)."""
    centre = 0.5 * (np.minimum.reduceat(points, first) + np.maximum.reduceat(points, first))
    away = np.linalg.norm(points - np.repeat(centre, end - first, axis=0), axis=1)
    return centre, _WIDER * np.maximum.reduceat(away, first)
