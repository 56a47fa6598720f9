"""Coincident points, and connected components of a graph, in plain NumPy.

SciPy's k-d tree and graph search give the same results, but importing them takes a quarter of the time of a command
that deforms a clip, and every rig that is read needs them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.limits import check_limit

__all__ = ["close_links", "close_pairs", "connected_parts"]

# a generic direction, along which only points that are near each other have nearly equal coordinates in most models
_ASKEW = np.array([0.5257, 0.6180, 0.5846])
_ROUNDING = 1e-14  # error of projections on it, relative to the largest coordinate


def close_pairs(points: NDArray[np.float64], distance: float) -> NDArray[np.int64]:
    """All pairs of points within a distance of each other, the lower index first, shape (m, 2).

    Points are sorted along a line, and each is compared with its successors there (sweep and prune).

    Args:
        points: Positions, shape (n, 3).
        distance: Largest distance; should be small compared with the distances of most points.

    Raises:
        InputError: There are more than the limit ``pairs``, as where thousands of points lie in one place.
    """
    along = points @ (_ASKEW / np.linalg.norm(_ASKEW))
    order = np.argsort(along, kind="stable")
    along = along[order]
    reach = distance + _ROUNDING * float(np.abs(points).max(initial=0.0))
    first = np.arange(len(points))
    found = []
    step = count = 0
    while first.size:
        step += 1
        first = first[: np.searchsorted(first, len(points) - step)]
        first = first[along[first + step] - along[first] <= reach]
        pairs = np.column_stack([order[first], order[first + step]])
        apart = points[pairs[:, 0]] - points[pairs[:, 1]]
        found.append(pairs[(apart * apart).sum(axis=1) <= distance * distance])
        count += len(found[-1])
        check_limit("pairs", count)
    return np.sort(np.concatenate(found), axis=1) if found else np.zeros((0, 2), dtype=np.int64)


def close_links(points: NDArray[np.float64], distance: float) -> NDArray[np.int64]:
    """Pairs of points within a distance of each other that connect what all such pairs connect, shape (m, 2).

    Points in exactly the same place, as the corners of many faces are, form a chain: their pairs would be as many as
    the square of their number.

    Args:
        points: Positions, shape (n, 3).
        distance: Largest distance; should be small compared with the distances of most places.

    Raises:
        InputError: There are more than the limit ``pairs`` between different places.
    """
    order = np.lexsort(points.T)
    placed = points[order]
    same = (placed[1:] == placed[:-1]).all(axis=1)
    chains = np.column_stack([order[:-1][same], order[1:][same]])
    different = order[np.concatenate([np.ones(min(len(order), 1), dtype=bool), ~same])]
    return np.concatenate([chains, different[close_pairs(points[different], distance)]])


def connected_parts(links: NDArray[np.integer], count: int) -> NDArray[np.int64]:
    """Connected component of each of ``count`` nodes of a graph with edges ``links`` (m, 2), shape (count,), numbered
    in the order of their first nodes."""
    lowest = np.arange(count)
    while True:
        a, b = lowest[links[:, 0]], lowest[links[:, 1]]
        apart = a != b
        if not apart.any():
            return np.unique(lowest, return_inverse=True)[1].ravel()
        # union: the higher root of two linked components gets the lower one as its parent
        links, a, b = links[apart], a[apart], b[apart]
        np.minimum.at(lowest, np.maximum(a, b), np.minimum(a, b))
        while (further := lowest[lowest]).tobytes() != lowest.tobytes():
            lowest = further
