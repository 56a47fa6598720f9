"""Dot products: one thread, one order of summation.

BLAS shares a dot product of 50,000 numbers between threads, which costs more than the product where other work waits
for the same cores, and sums in an order that depends on how many there are.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["dot", "norm"]


def dot(a: NDArray[Any], b: NDArray[Any]) -> float:
    """a · b of two vectors, the same bits every run."""
    return float(np.einsum("i,i->", a, b))


def norm(a: NDArray[Any]) -> float:
    """Euclidean length of a vector; NaN or infinity where it holds one."""
    return math.sqrt(dot(a, a))
