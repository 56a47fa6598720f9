"""Back-face culling: whether only the front faces of a surface need to be drawn."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["visible_side"]


def visible_side(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> Literal["front", "double"]:
    """``front`` for a closed, consistently oriented surface with triangles (T, 3) wound outwards, else ``double``.

    Browsers with software rendering spend a third of their time on the back faces of a hand.
    """
    if not len(faces):
        return "double"
    half_edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    count = int(half_edges.max()) + 1
    keys, opposite = half_edges[:, 0] * count + half_edges[:, 1], half_edges[:, 1] * count + half_edges[:, 0]
    unique = np.unique(keys)
    if len(unique) != len(keys) or not np.array_equal(unique, np.sort(opposite)):
        return "double"
    a, b, c = (vertices[faces[:, k]].astype(np.float64) - vertices.mean(axis=0) for k in range(3))
    return "front" if np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0 else "double"
