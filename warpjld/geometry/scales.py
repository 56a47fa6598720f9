"""Transforms that scale: zero scale made tiny, so that it can be inverted, and the rotation in a linear map."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["TINY", "never_zero", "polar", "regular_linear"]

TINY = 1e-7
"""What stands for zero scale: the square of it still leaves float64 nine digits."""


def never_zero(scale: ArrayLike) -> NDArray[np.float64]:
    """Scales of any shape; those nearer to zero than ``TINY`` become that, with their sign."""
    array = np.asarray(scale, dtype=np.float64)
    return np.where(np.abs(array) < TINY, np.where(array < 0.0, -TINY, TINY), array)


def regular_linear(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """A linear map (3, 3) that flattens space, made to keep a tiny bit of every direction and not to mirror."""
    left, lengths, right = np.linalg.svd(linear)
    if np.linalg.det(left) * np.linalg.det(right) < 0.0:
        left[:, -1] *= -1.0  # the side of a direction without length is free
    return np.asarray((left * np.maximum(lengths, TINY)) @ right)


def polar(linear: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rotation nearest to linear maps, and how much they stretch.

    Args:
        linear: Shape (…, 3, 3).

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
