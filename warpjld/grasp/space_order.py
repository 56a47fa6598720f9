"""Order of points along a space-filling curve, so that points one after another are near each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["along_curve"]

_BITS = 8  # cells of the curve along the longest side, as a power of two: a hand has one in 0.8 mm


def along_curve(points: NDArray[np.floating]) -> NDArray[np.int32]:
    """Indices of points (n, 3) in the order of their Morton codes: the bits of their cells' numbers, interleaved."""
    low = points.min(axis=0)
    size = float((points.max(axis=0) - low).max())
    cell = ((points - low) * ((2**_BITS - 1) / max(size, 1e-30))).astype(np.uint32)
    code = np.zeros(len(points), dtype=np.uint32)
    for bit in range(_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable").astype(np.int32)
