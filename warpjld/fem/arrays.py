"""Array types used in signatures of ``fem``, and products of vectors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Ints", "Ints32", "Mask", "cross_matrix", "dot", "norm"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Ints32 = NDArray[np.int32]
Mask = NDArray[np.bool_]


def dot(a: NDArray[Any], b: NDArray[Any]) -> float:
    """a · b of two vectors, bitwise reproducible: one thread, a fixed order of summation.

    BLAS distributes a dot product of 50,000 numbers over threads, which costs more than the product while other work
    uses the same cores, and sums in an order that depends on their number.
    """
    return float(np.einsum("i,i->", a, b))


def norm(a: NDArray[Any]) -> float:
    """Euclidean norm of a vector; NaN or infinite if the vector contains such values."""
    return math.sqrt(dot(a, a))


def cross_matrix(v: Array) -> Array:
    """Cross-product matrices [v]× of vectors (n, 3), shape (n, 3, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - out.transpose(0, 2, 1)
