"""Cells of a regular grid whose boundary is a surface: what a fitted mesh is grown from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

__all__ = ["core_cells", "make_manifold"]


def core_cells(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells all of whose eight corners are inside; ``inside`` is of grid nodes, shape (ni + 1, nj + 1, nk + 1)."""
    low, high = slice(None, -1), slice(1, None)
    out = np.ones([n - 1 for n in inside.shape], dtype=bool)
    for i in (low, high):
        for j in (low, high):
            for k in (low, high):
                out &= inside[i, j, k]
    return out


def make_manifold(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Remove cells until no two meet at an edge or a corner only, and neither do two empty ones.

    Args:
        cells: Chosen cells, an empty rim around them.
    """
    cells = cells.copy()
    while True:
        around = np.stack([_shifted(cells, corner) for corner in np.ndindex(2, 2, 2)], axis=-1)
        wrong = _BROKEN[(around * (1 << np.arange(8))).sum(axis=-1)]
        if not wrong.any():
            return cells
        # at each broken node, remove the cells that have fewest neighbours
        count = ndimage.convolve(
            cells.astype(int), ndimage.generate_binary_structure(3, 1).astype(int), mode="constant"
        )
        for i, j, k in np.argwhere(wrong):
            block = tuple(slice(n - 1, n + 1) for n in (i, j, k))
            present = cells[block]
            if not present.any():
                continue
            weight = np.where(present, count[block], 99)
            cells[block] = present & (weight > weight.min())


def _shifted(cells: NDArray[np.bool_], corner: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Cell at one of the eight places around each grid node."""
    out = np.zeros([n + 1 for n in cells.shape], dtype=bool)
    place = tuple(slice(1 - c, n + 1 - c) for c, n in zip(corner, cells.shape, strict=True))
    out[place] = cells
    return out


def _broken_patterns() -> NDArray[np.bool_]:
    """Which of the 256 ways to fill the cells around a node leave them, or the empty ones, in more than one piece."""
    table = np.zeros(256, dtype=bool)
    corners = list(np.ndindex(2, 2, 2))
    for pattern in range(256):
        # place (0, 0, 0) of _shifted is the cell above the node along every axis: its mirror is as good here
        filled = np.zeros((2, 2, 2), dtype=bool)
        for bit, corner in enumerate(corners):
            filled[corner] = bool(pattern >> bit & 1)
        table[pattern] = ndimage.label(filled)[1] > 1 or ndimage.label(~filled)[1] > 1
    return table


_BROKEN = _broken_patterns()
