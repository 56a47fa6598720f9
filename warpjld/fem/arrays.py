"""Array types that signatures of ``fem`` are written with, and dot products that are the same bits every run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Ints", "Ints32", "Mask", "dot", "norm"]

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
