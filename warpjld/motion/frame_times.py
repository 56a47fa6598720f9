"""Times of frames, and a bound on how many."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["frame_times"]

_MOST = 1_000_000
"""Hours of motion: more is a slip of the pen in a rate or a frame number, and would fill the memory."""


def frame_times(first: float, last: float, rate: float) -> NDArray[np.float64]:
    """Times from ``first`` to ``last``, both included where they fall on a frame, shape (F,).

    Args:
        first: First time [s].
        last: Last time [s].
        rate: Frames a second.

    Raises:
        InputError: More than a million frames.
    """
    count = (last - first) * rate
    if not count < _MOST:
        raise InputError(f"{count:.3g} frames from {first:g} to {last:g} at {rate:g} a second: at most {_MOST}")
    return np.asarray(first + np.arange(int(np.floor(count + 1e-6)) + 1) / rate)
