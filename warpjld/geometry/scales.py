"""Linear maps with scale: regularisation of zero scales, so that they can be inverted, and polar decomposition."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["TINY", "never_zero", "polar", "regular_linear"]

TINY = 1e-7
"""Replacement of zero scales; its square still leaves float64 nine digits."""


def never_zero(scale: ArrayLike) -> NDArray[np.float64]:
    """Scales of any shape, with absolute values of at least ``TINY`` and the same signs."""
    array = np.asarray(scale, dtype=np.float64)
    return np.where(np.abs(array) < TINY, np.where(array < 0.0, -TINY, TINY), array)


def regular_linear(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """A singular linear map (3, 3) with singular values raised to at least ``TINY`` and a positive determinant."""
    left, lengths, right = np.linalg.svd(linear)
    if np.linalg.det(left) * np.linalg.det(right) < 0.0:
        left[:, -1] *= -1.0  # the sign of a direction of singular value zero is arbitrary
    return np.asarray((left * np.maximum(lengths, TINY)) @ right)


def polar(linear: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nearest rotations and singular values of linear maps (polar decomposition).

    Args:
        linear: Linear maps, shape (…, 3, 3).

    Returns:
        Rotations, shape (…, 3, 3), and singular values, largest first, shape (…, 3); the last is negative where the
        map mirrors.
    """
    left, lengths, right = np.linalg.svd(linear)
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right))
    lengths = np.array(lengths)
    lengths[..., -1] *= sign
    left = np.array(left)
    left[..., -1] *= sign[..., None]
    return left @ right, lengths
