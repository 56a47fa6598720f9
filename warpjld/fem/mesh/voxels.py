"""Cells of a regular grid whose boundary is a surface: what a fitted mesh is grown from."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from warpjld.fem.arrays import Ints, Mask

__all__ = ["core_cells", "make_manifold"]


def core_cells(inside: Mask) -> Mask:
    """Cells all of whose eight corners are inside; ``inside`` is of grid nodes, shape (ni + 1, nj + 1, nk + 1)."""
    low, high = slice(None, -1), slice(1, None)
    out = np.ones([n - 1 for n in inside.shape], dtype=bool)
    for i in (low, high):
        for j in (low, high):
            for k in (low, high):
                out &= inside[i, j, k]
    return out


def make_manifold(cells: Mask, spare: Mask | None = None) -> Mask:
    """Change as few cells as it takes until no two meet at an edge or a corner only, and neither do two empty ones.

    Args:
        cells: Chosen cells, an empty rim around them.
        spare: Cells that may be added; others are only removed.
    """
    cells = cells.copy()
    left = np.zeros_like(cells) if spare is None else spare & ~cells
    while True:
        around = np.stack([_shifted(cells, corner) for corner in np.ndindex(2, 2, 2)], axis=-1)
        wrong = _BROKEN[around @ _BITS]
        if not wrong.any():
            return cells
        count = ndimage.convolve(
            cells.astype(int), ndimage.generate_binary_structure(3, 1).astype(int), mode="constant"
        )
        for i, j, k in np.argwhere(wrong):
            block = tuple(slice(n - 1, n + 1) for n in (i, j, k))
            cells[block], left[block] = _mended(cells[block], left[block], count[block])


def _mended(present: Mask, spare: Mask, count: Ints) -> tuple[Mask, Mask]:
    """Eight cells around a node and what is still spare of them, changed least: cells that have few neighbours are
    removed, or spare ones added."""
    price = np.where(present, 6.0 + count, np.where(spare, 8.0, np.inf)).ravel()
    pattern = present.ravel()
    if not _BROKEN[int(pattern @ _BITS)]:
        return present, spare
    best, mended = np.inf, present
    for flips, number in zip(_FLIPS, _FLIPS @ _BITS, strict=True):
        cost = price[flips].sum()
        if cost < best and not _BROKEN[int(pattern @ _BITS) ^ int(number)]:
            best, mended = cost, (pattern ^ flips).reshape(2, 2, 2)
    return mended, spare & ~mended & ~present


def _shifted(cells: Mask, corner: tuple[int, int, int]) -> Mask:
    """Cell at one of the eight places around each grid node."""
    out = np.zeros([n + 1 for n in cells.shape], dtype=bool)
    place = tuple(slice(1 - c, n + 1 - c) for c, n in zip(corner, cells.shape, strict=True))
    out[place] = cells
    return out


def _broken_patterns() -> Mask:
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
_BITS = 1 << np.arange(8)
_FLIPS = np.array([[bool(n >> bit & 1) for bit in range(8)] for n in range(1, 256)])
