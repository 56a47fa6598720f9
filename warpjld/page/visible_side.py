"""Which side of a surface is ever seen: of a closed one the outside, and what is not drawn costs nothing."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["visible_side"]


def visible_side(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> Literal["front", "double"]:
    """``front`` of a closed surface whose triangles (T, 3) are all wound outwards, else ``double``.

    Browsers that draw in software spend a third of their time on the backs of a hand's triangles.
    """
    if not len(faces):
        return "double"
    ways = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    count = int(ways.max()) + 1
    there, back = ways[:, 0] * count + ways[:, 1], ways[:, 1] * count + ways[:, 0]
    once = np.unique(there)
    if len(once) != len(there) or not np.array_equal(once, np.sort(back)):
        return "double"
    a, b, c = (vertices[faces[:, k]].astype(np.float64) - vertices.mean(axis=0) for k in range(3))
    return "front" if np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0 else "double"
