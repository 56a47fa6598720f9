"""Refined surfaces: some triangles are split in four, so that colours change within them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["RefinedSurface", "refine_surface"]


@dataclass(frozen=True, eq=False)
class RefinedSurface:
    """The vertices of a surface, and behind them the middles of some edges.

    Attributes:
        faces: Triangles over both, shape (T, 3).
        edges: Ends of the edges with a middle, shape (M, 2).
    """

    faces: NDArray[np.int32]
    edges: NDArray[np.int32]

    def of(self, values: NDArray[np.floating]) -> NDArray[np.float64]:
        """Positions, or other values, of all of them (V + M, …) from those of the surface's vertices (V, …)."""
        return np.concatenate([values, 0.5 * (values[self.edges[:, 0]] + values[self.edges[:, 1]])], dtype=np.float64)


def refine_surface(faces: NDArray[np.integer], chosen: NDArray[np.bool_], count: int) -> RefinedSurface:
    """Split triangles (T, 3) over ``count`` vertices in four where they are chosen (T,), and those beside them in two
    or three: edges have a middle on both sides or on neither."""
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


def _triangles(some: Any, *corners: tuple[NDArray[np.integer], ...]) -> list[NDArray[np.integer]]:
    return [np.stack(three, axis=1)[some] for three in corners]
