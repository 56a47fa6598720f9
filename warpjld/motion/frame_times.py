"""Frame times, and estimation of the frame rate from key times."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.limits import check_limit

__all__ = ["frame_rate", "frame_times", "merged_times"]

_DEFAULT_RATE = 30.0  # frames a second where key times give none
_NTSC = 1000.0 / 1001.0  # broadcast rates: 29.97 is 30 times this
_COMMON = (30.0, 24.0, 25.0, 60.0, 30.0 * _NTSC, 24.0 * _NTSC, 60.0 * _NTSC, 50.0, 48.0, 120.0, 100.0, 90.0, 240.0)
"""Frame rates tried for reduced keys, the most likely first."""

_SINGLE = float(np.finfo(np.float32).eps)
_SLOWEST, _FASTEST = 10.0, 1000.0  # range of rates at which evenly spaced keys count as frames
_ON_FRAME = 0.01  # tolerance for keys on frames, in frames
_EVEN = 0.05  # tolerance for even spacing, in frames: allows for whole milliseconds at 60 frames a second


def frame_times(first: float, last: float, rate: float) -> NDArray[np.float64]:
    """Frame times from ``first`` to ``last``, both included where they fall on a frame, shape (F,).

    Tolerates times rounded to float32 and rates rounded to three digits without losing the last frame.

    Args:
        first: First time [s].
        last: Last time [s].
        rate: Frames a second.

    Raises:
        InputError: More frames than the limit allows, as after a typing error in a rate or frame number.
    """
    count = (last - first) * rate
    check_limit("frames", count, of=f"{first:g} to {last:g} s at {rate:g} frames a second")
    # 2e-5 per frame: the error of 29.97 for 30000/1001, the largest from rounding a rate, over a hundred seconds
    slack = min(_ON_FRAME + 1e-6 * count + 2.0 * _SINGLE * max(abs(first), abs(last)) * rate, 0.4)
    return np.asarray(first + np.arange(int(np.floor(count + slack)) + 1) / rate)


def merged_times(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distinct key times, increasing; times that differ by float32 rounding only are merged."""
    times = np.unique(times)
    apart = np.diff(times, prepend=-np.inf) > 4.0 * _SINGLE * np.abs(times).max(initial=0.0)
    return np.asarray(times[apart])


def frame_rate(times: NDArray[np.float64]) -> float:
    """Frames a second of key times.

    Evenly spaced keys are frames. For reduced keys, or poses far apart, the first common rate is taken on whose frames
    all keys fall; 30 if there is none.

    Args:
        times: Distinct times [s], increasing, with float32 accuracy, shape (K,).
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
    """The simplest number within ``error`` of an estimated rate."""
    broadcast = round(rate / _NTSC) * _NTSC
    for candidate in (float(round(rate)), broadcast, round(rate, 2), round(rate, 3)):
        if abs(candidate - rate) <= max(error, 2e-6 * rate):
            return candidate
    return rate
