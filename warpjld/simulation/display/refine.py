"""Local refinement of triangulated surfaces (red–green), for colours that vary within triangles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["RefinedSurface", "refine_surface"]


@dataclass(frozen=True, eq=False)
class RefinedSurface:
    """A refined surface: the vertices of the original one, followed by midpoints of edges.

    Attributes:
        faces: Triangles, shape (T, 3).
        edges: End vertices of the split edges, shape (M, 2).
    """

    faces: NDArray[np.int32]
    edges: NDArray[np.int32]

    def of(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Values at all vertices (V + M, …) from those at the original ones (V, …), as positions."""
        return np.concatenate([values, 0.5 * (values[self.edges[:, 0]] + values[self.edges[:, 1]])], dtype=np.float64)


def refine_surface(faces: NDArray[np.integer], chosen: NDArray[np.bool_], count: int) -> RefinedSurface:
    """Split chosen triangles into four, and their neighbours into two or three so that no hanging vertices remain.

    Args:
        faces: Triangles, shape (T, 3).
        chosen: Mask of the triangles to split, shape (T,).
        count: Number of vertices.
    """
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).astype(np.int64)
    key = (sides @ [count, 1]).reshape(-1, 3)
    split = np.unique(key[chosen])
    marked = np.isin(key, split)
    middle = count + np.searchsorted(split, key)
    parts = [faces[~marked.any(axis=1)]]
    for k in range(3):  # turned so that edge k comes first
        turned = np.roll(marked, -k, axis=1)
        (a, b, c), (ab, bc, ca) = np.roll(faces, -k, axis=1).T, np.roll(middle, -k, axis=1).T
        one, two = (turned == [True, False, False]).all(axis=1), (turned == [True, True, False]).all(axis=1)
        parts += _triangles(one, (a, ab, c), (ab, b, c))
        parts += _triangles(two, (ab, b, bc), (a, ab, c), (ab, bc, c))
        if k == 0:
            parts += _triangles(turned.all(axis=1), (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    edges = np.stack([split // count, split % count], axis=1)
    return RefinedSurface(np.concatenate(parts).astype(np.int32), edges.astype(np.int32))


def _triangles(mask: Any, *corners: tuple[NDArray[np.integer], ...]) -> list[NDArray[np.integer]]:
    """Triangles from columns of corners, restricted to masked rows."""
    return [np.stack(three, axis=1)[mask] for three in corners]
