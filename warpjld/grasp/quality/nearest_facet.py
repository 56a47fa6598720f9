"""Distance from the origin to the boundary of convex hulls in six dimensions, without all their facets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["distances_to_boundary", "hull_measures"]

Array = NDArray[np.float64]

_SHAKE = 1e-7  # perturbation that brings points into general position, as a part of the largest coordinate
_BEYOND = 1e-11  # height beyond a facet from which a point is outside it, likewise
_SLACK = 1e-6  # facets no more than this farther than the nearest may be the nearest without the perturbation, likewise
_ON = 2e-6  # points no more than this below a perturbed facet may be on the facet without the perturbation, likewise
_FLAT = 1e-12  # largest height of points on one facet, likewise
_THIN = 1e-3  # smallest extent of a facet, as a part of its largest, that defines a plane


def distances_to_boundary(hulls: Sequence[Array]) -> list[float | None]:
    """Distance from the origin to the boundary of the convex hull of each set of points (k, 6); None where in doubt.

    The points are perturbed so that all facets are simplices, and the nearest facets are searched by a kernel
    (``warpjld_kernels.wrench_hull``). Their exact planes are those through the unperturbed points that lie on them. A
    distance is in doubt where these points do not define a plane, or another point lies beyond it.

    Args:
        hulls: Sets of points, each of which contains the origin.
    """
    if not hulls:
        return []
    found, _ = _near_facets(hulls, whole=False)
    nearest = [_exact(own, normals) for own, normals in zip(hulls, found, strict=True)]
    return [None if one is None else one[0] for one in nearest]


def hull_measures(points: Array) -> tuple[float, float, Array] | None:
    """Volume of the convex hull of points (k, 6), distance from the origin to its boundary and normal there (6,).

    None where in doubt, as for ``distances_to_boundary``, or if the hull has too many facets for the kernel.

    Args:
        points: The points, among them the origin.
    """
    (normals,), (volume,) = _near_facets([points], whole=True)
    nearest = _exact(points, normals)
    return None if nearest is None else (float(volume), *nearest)


def _near_facets(hulls: Sequence[Array], *, whole: bool) -> tuple[list[Array], Array]:
    """Normals (n, 6) of the perturbed facets nearest to the origin, n = 0 where in doubt; volumes of whole hulls."""
    import warp as wp
    from warpjld_kernels import growing_hull, wrench_hull

    counts, rows = [len(points) for points in hulls], len(hulls)
    volumes, nothing = np.zeros(rows), [np.zeros((0, 6)) for _ in hulls]
    if max(counts) > growing_hull.MOST_POINTS:
        return nothing, volumes
    facets, table = wrench_hull.MOST_FACETS, wrench_hull.TABLE
    if whole:
        facets, table = wrench_hull.MOST_OF_WHOLE, wrench_hull.TABLE_OF_WHOLE
    sizes = np.array([_size(points) for points in hulls])
    shaken = np.random.default_rng(0).uniform(-_SHAKE, _SHAKE, (max(counts), 6))
    points = np.concatenate([own + size * shaken[: len(own)] for own, size in zip(hulls, sizes, strict=True)])
    normals, found = np.zeros((rows, 6 * wrench_hull.NEAREST)), np.zeros(rows, dtype=np.int32)
    exact = [(np.concatenate(hulls).reshape(-1), wp.float64)] if whole else []
    arrays = (
        (points.reshape(-1), wp.float64),
        *exact,
        (np.cumsum([0, *counts]).astype(np.int32), wp.int32),
        (_BEYOND * sizes, wp.float64),
        (_SLACK * sizes, wp.float64),
        (np.empty((rows, growing_hull.STRIDE * facets)), wp.float64),
        (np.empty((rows, 6 * max(counts))), wp.float64),
        (np.empty((rows, 6 * facets), dtype=np.int32), wp.int32),
        (np.empty((rows, table), dtype=np.uint64), wp.uint64),
        (normals, wp.float64),
        (found, wp.int32),
        *([(volumes, wp.float64)] if whole else []),
    )
    given = [wp.array(a, dtype=kind, device="cpu", copy=False) for a, kind in arrays]
    kernel = wrench_hull.whole_hulls if whole else wrench_hull.nearest_facets
    wp.launch(kernel, rows, inputs=given, device="cpu")
    near = normals.reshape(rows, wrench_hull.NEAREST, 6)
    return [near[k, : max(found[k], 0)] for k in range(rows)], volumes


def _size(points: Array) -> float:
    """Largest coordinate of points."""
    return max(float(np.abs(points).max()), 1e-300)


def _exact(points: Array, normals: Array) -> tuple[float, Array] | None:
    """Smallest distance of the planes of facets with nearly these normals (n, 6), and that plane's normal (6,).

    None where none defines a plane.
    """
    size = _size(points)
    least: tuple[float, Array] | None = None
    for normal in normals:
        heights = points @ normal
        on = points[heights >= heights.max() - _ON * size]
        middle = on.mean(axis=0)
        _, extents, axes = np.linalg.svd(on - middle, full_matrices=True)
        wide = int((extents > _THIN * extents[0]).sum())
        # the normal of all points on the facet that is nearest to the perturbed one
        plane = axes[wide:].T @ (axes[wide:] @ normal)
        plane /= np.linalg.norm(plane)
        away, along = float(plane @ middle), points @ plane
        if along.max() > away + _FLAT * size or (on @ plane).min() < away - _FLAT * size:
            if wide == 5:
                return None
            continue
        if away <= _FLAT * size:  # the origin is a point of the hull, and here on its boundary
            return 0.0, plane
        if wide == 5:  # else a face of fewer dimensions, which facets as near or nearer contain
            least = (away, plane) if least is None or away < least[0] else least
    return least
