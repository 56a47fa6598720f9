"""Surface of a box, triangulated by a grid on each side."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["box_surface"]


def box_surface(lines: Sequence[NDArray[np.float64]]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, 3) and triangles (t, 3), counterclockwise seen from outside; sides share no points.

    Args:
        lines: Ascending coordinates of the grid lines along x, y and z; the first and last are the sides of the box.
    """
    points, faces, start = [], [], 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, -1):
            grid = np.stack(np.meshgrid(lines[u], lines[v], indexing="ij"), axis=-1)
            side = np.full((*grid.shape[:2], 3), lines[axis][end])
            side[..., u], side[..., v] = grid[..., 0], grid[..., 1]
            index = np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape[:2]) + start
            a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
            quads = np.stack([a, b, c, d] if end else [a, d, c, b], axis=-1).reshape(-1, 4)
            faces += [quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]
            points.append(side.reshape(-1, 3))
            start += len(points[-1])
    return np.concatenate(points), np.concatenate(faces)
