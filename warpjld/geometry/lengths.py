"""Admissible range of coordinates and sizes, since surfaces are deformed in single precision.

A single float has seven digits and ends at 3e38, and volumes, areas and their squares are powers of lengths: between
SMALLEST and LARGEST none of them overflows or underflows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["FURTHEST", "LARGEST", "SMALLEST", "check_reach", "check_size"]

SMALLEST = 1e-5
"""Diagonal of the smallest surface [m]: a hundredth of a millimetre."""
LARGEST = 1e6
"""Furthest coordinate from the origin [m]: a thousand kilometres."""
FURTHEST = 1e12
"""Largest absolute value of a file's coordinates, in its own unit."""


def check_reach(numbers: NDArray[np.float64], what: str, *, path: str | Path | None = None) -> None:
    """Check that a file's own coordinates are finite and no larger than FURTHEST.

    Args:
        numbers: Coordinates of any shape, in the file's unit.
        what: Their name in messages.
        path: The file concerned.

    Raises:
        InputError: One of them is not.
    """
    reach = float(np.abs(numbers).max(initial=0.0))
    if not reach <= FURTHEST:
        raise InputError(f"{what} lie at {reach:.3g}: coordinates are read up to {FURTHEST:.0e}", path=path)


def check_size(
    points: NDArray[np.float64],
    what: str,
    remedy: str = "its unit or scale",
    *,
    least: float = SMALLEST,
    path: str | Path | None = None,
) -> None:
    """Check that points lie within the admissible range.

    Args:
        points: Positions [m], shape (…, 3).
        what: Their name in messages.
        remedy: What the user can change to bring them into the range.
        least: Smallest diagonal of their bounding box [m]; 0 where they may coincide.
        path: The file concerned.

    Raises:
        InputError: They reach beyond LARGEST, or are smaller than ``least``.
    """
    flat = points.reshape(-1, 3)
    if not len(flat):
        return
    low, high = flat.min(axis=0), flat.max(axis=0)
    reach = float(max(np.abs(low).max(), np.abs(high).max()))
    if not reach <= LARGEST:
        raise InputError(f"{what} reaches to {reach:.3g} m; at most {LARGEST:g} m: give {remedy}", path=path)
    size = float(np.linalg.norm(high - low))
    if size < least:
        raise InputError(f"{what} is {size:.3g} m large; at least {least:g} m: give {remedy}", path=path)
