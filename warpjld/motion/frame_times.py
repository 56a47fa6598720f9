"""Times of frames, how many there are, and the rate that key times were written at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.limits import check_limit

__all__ = ["frame_rate", "frame_times", "merged_times"]

_DEFAULT_RATE = 30.0  # frames a second where times say nothing
_NTSC = 1000.0 / 1001.0  # rates of broadcast: 29.97 is 30 of these
_COMMON = (30.0, 24.0, 25.0, 60.0, 30.0 * _NTSC, 24.0 * _NTSC, 60.0 * _NTSC, 50.0, 48.0, 120.0, 100.0, 90.0, 240.0)
"""Rates at which keys that were thinned out may lie, the likeliest first."""

_SINGLE = float(np.finfo(np.float32).eps)
_SLOWEST, _FASTEST = 10.0, 1000.0  # keys further apart are poses to move between, not frames
_ON_FRAME = 0.01  # of a frame: what counts as falling on one
_EVEN = 0.05  # of a frame: milliseconds without decimals are even at 60 a second


def frame_times(first: float, last: float, rate: float) -> NDArray[np.float64]:
    """Times from ``first`` to ``last``, both included where they fall on a frame, shape (F,).

    Times that went through float32, and rates rounded to three digits, do not lose the last frame.

    Args:
        first: First time [s].
        last: Last time [s].
        rate: Frames a second.

    Raises:
        InputError: More frames than the limit allows: a slip of the pen in a rate or a frame number.
    """
    count = (last - first) * rate
    check_limit("frames", count, of=f"{first:g} to {last:g} s at {rate:g} frames a second")
    # 2e-5 a frame: 29.97 for 30000/1001, in a hundred seconds, is the most that rounding a rate may cost
    slack = min(_ON_FRAME + 1e-6 * count + 2.0 * _SINGLE * max(abs(first), abs(last)) * rate, 0.4)
    return np.asarray(first + np.arange(int(np.floor(count + slack)) + 1) / rate)


def merged_times(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distinct times of keys, increasing: those that only float32 tells apart are one."""
    times = np.unique(times)
    apart = np.diff(times, prepend=-np.inf) > 4.0 * _SINGLE * np.abs(times).max(initial=0.0)
    return np.asarray(times[apart])


def frame_rate(times: NDArray[np.float64]) -> float:
    """Frames a second at which key times were written.

    Evenly spaced keys are the frames themselves. Keys that were thinned out, or lie apart as poses do, are looked for
    on the frames of a common rate; 30 where none fits.

    Args:
        times: Distinct times [s], increasing, as float32 keeps them, shape (K,).
    """
    if len(times) < 2:
        return _DEFAULT_RATE
    length = float(times[-1] - times[0])
    rounding = 2.0 * _SINGLE * float(np.abs(times).max())  # of a difference of two times
    rate = (len(times) - 1) / length
    off = float(np.abs((times - times[0]) * rate - np.arange(len(times))).max())  # of a frame
    if _SLOWEST <= rate <= _FASTEST and off < _EVEN + rounding * rate:
        return _nicest(rate, rate * (rounding / length + off / (len(times) - 1)))
    for common in _COMMON:
        place = (times - times[0]) * common
        if np.abs(place - np.round(place)).max() < _ON_FRAME + rounding * common:
            return common
    return _DEFAULT_RATE


def _nicest(rate: float, error: float) -> float:
    """The plainest number within ``error`` of a measured rate."""
    broadcast = round(rate / _NTSC) * _NTSC
    for candidate in (float(round(rate)), broadcast, round(rate, 2), round(rate, 3)):
        if abs(candidate - rate) <= max(error, 2e-6 * rate):
            return candidate
    return rate
