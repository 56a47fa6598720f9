"""Array types that signatures of ``fem`` are written with, and what vectors are multiplied by."""

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
    """a · b of two vectors, the same bits every run: one thread, one order of summation.

    BLAS shares a dot product of 50,000 numbers between threads, which costs more than the product where other work
    waits for the same cores, and sums in an order that depends on how many there are.
    """
    return float(np.einsum("i,i->", a, b))


def norm(a: NDArray[Any]) -> float:
    """Euclidean length of a vector; NaN or infinity where it holds one."""
    return math.sqrt(dot(a, a))


def cross_matrix(v: Array) -> Array:
    """[v]× of vectors (n, 3), shape (n, 3, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - out.transpose(0, 2, 1)
