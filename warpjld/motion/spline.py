"""Kochanek–Bartels splines of one channel (R3; Kochanek and Bartels 1984, "Interpolating splines with local tension,
continuity, and bias control")."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.errors import InputError

__all__ = ["Spline"]


_LEVEL = 1e-3
"""Chord relative to the larger one beside it below which tangents fade: values that differ by less look equal, and
digits lost in a file (12 are written) still make no difference."""


class Spline:
    """An interpolating cubic spline, with tension t, continuity c and bias b at every key.

    With the chords p = v[i] - v[i-1] and n = v[i+1] - v[i], the tangents that arrive at and leave key i are

        arriving = (1-t)(1-c)(1+b)/2 p + (1-t)(1+c)(1-b)/2 n
        leaving  = (1-t)(1+c)(1+b)/2 p + (1-t)(1-c)(1-b)/2 n

    per interval; both are divided by the mean length of the two intervals, the paper's adjustment for unevenly spaced
    keys: the speed is continuous where c = 0, and keys on a straight line give that line. At the first and last key the
    missing chord is the mirror image of the present one. Outside the keys the spline is constant.

    Between two equal neighbouring keys that both have the default constants the value is held, instead of the small
    overshoot of the formula; constants other than zero, or ``hold=False``, give the formula everywhere. Tangents fade
    where neighbours become equal, so that the curve is continuous in the values.

    Args:
        times: Key times, finite and increasing, shape (K,).
        values: Key values, shape (K,).
        tension: 1 stops at the key, -1 passes it fast; a number or one per key.
        continuity: Values other than 0 make a corner.
        bias: 1 overshoots after the key, -1 before it.
        hold: Whether the value is held between equal neighbours.

    Raises:
        InputError: No keys, wrong shapes, values not finite, times not increasing.
    """

    def __init__(
        self,
        times: ArrayLike,
        values: ArrayLike,
        tension: ArrayLike = 0.0,
        continuity: ArrayLike = 0.0,
        bias: ArrayLike = 0.0,
        *,
        hold: bool = True,
    ) -> None:
        x = np.asarray(times, dtype=np.float64)
        v = np.asarray(values, dtype=np.float64)
        if x.ndim != 1 or len(x) == 0 or v.shape != x.shape:
            raise InputError(f"spline: want as many times as values, at least one, got {x.shape} and {v.shape}")
        t, c, b = (
            _per_key(name, array, len(x))
            for name, array in (("tension", tension), ("continuity", continuity), ("bias", bias))
        )
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise InputError("spline: times and values must be finite")
        if (np.diff(x) <= 0.0).any():
            raise InputError(f"spline: times must increase, but {x[np.argmax(np.diff(x) <= 0.0) + 1]:g} does not")
        self.times = x
        self.values = v
        self._cubics = _cubics(x, v, t, c, b, hold) if len(x) > 1 else None

    def __call__(self, times: ArrayLike) -> NDArray[np.float64]:
        """Values at any times, in the shape of ``times``."""
        at = np.clip(np.asarray(times, dtype=np.float64), self.times[0], self.times[-1])
        if self._cubics is None:
            return np.full(at.shape, self.values[0])
        (a, b, c, d), s = self._at(at)
        return np.asarray(((a * s + b) * s + c) * s + d)

    def derivative(self, times: ArrayLike) -> NDArray[np.float64]:
        """Slopes at times within the keys, in the shape of ``times``; at a key that of the interval after it."""
        at = np.asarray(times, dtype=np.float64)
        if self._cubics is None:
            return np.zeros(at.shape)
        (a, b, c, _), s = self._at(at)
        return np.asarray((3.0 * a * s + 2.0 * b) * s + c)

    def _at(self, times: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Coefficients of the cubics at these times, highest power first, and the times since their keys."""
        assert self._cubics is not None
        k = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        return self._cubics[:, k], times - self.times[k]


def _per_key(name: str, constant: ArrayLike, count: int) -> NDArray[np.float64]:
    array = np.asarray(constant, dtype=np.float64)
    if array.shape not in ((), (count,)) or not np.isfinite(array).all():
        raise InputError(f"spline: {name} needs one finite number or {count}, got shape {array.shape}")
    return np.broadcast_to(array, count)


def _cubics(
    x: NDArray[np.float64],
    v: NDArray[np.float64],
    t: NDArray[np.float64],
    c: NDArray[np.float64],
    b: NDArray[np.float64],
    hold: bool,
) -> NDArray[np.float64]:
    lengths, chords = np.diff(x), np.diff(v)
    before, after = np.concatenate([chords[:1], chords]), np.concatenate([chords, chords[-1:]])
    mean = (np.concatenate([lengths[:1], lengths]) + np.concatenate([lengths, lengths[-1:]])) / 2.0
    relaxed = (1.0 - t) / 2.0 / mean
    arriving = relaxed * ((1.0 - c) * (1.0 + b) * before + (1.0 + c) * (1.0 - b) * after)
    leaving = relaxed * ((1.0 + c) * (1.0 + b) * before + (1.0 - c) * (1.0 - b) * after)
    if hold:
        default = (t == 0.0) & (c == 0.0) & (b == 0.0)
        moves = np.where(default[1:] & default[:-1], _moving(np.abs(chords)), 1.0)
        share = np.minimum(np.concatenate([moves, [1.0]]), np.concatenate([[1.0], moves]))
        arriving, leaving = share * arriving, share * leaving
    slope = chords / lengths
    start, end = leaving[:-1], arriving[1:]
    square = (3.0 * slope - 2.0 * start - end) / lengths
    return np.array([(start + end - 2.0 * slope) / lengths**2, square, start, v[:-1]])


def _moving(chords: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of its tangents that an interval keeps, from the lengths of all chords: 0 between equal values, 1 where
    they clearly differ; shape (K - 1,)."""
    beside = np.maximum(np.concatenate([[0.0], chords[:-1]]), np.concatenate([chords[1:], [0.0]]))
    return np.where(chords > 0.0, np.minimum(chords / np.maximum(_LEVEL * beside, 1e-300), 1.0), 0.0)
