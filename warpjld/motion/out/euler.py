"""Conversion of rotations to Euler angles that are continuous over frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["ContinuousEuler"]

_LOCKED = 1e-7  # cosine of the middle angle below which the others are not determined separately (gimbal lock)
_TURN = 2.0 * np.pi  # rad


class ContinuousEuler:
    """Angles z, x, y with R = Rz(z) Rx(x) Ry(y) of B joints, computed frame after frame.

    Every rotation has two such triples, up to whole turns: the one nearest to the previous frame is taken (in the first
    frame, nearest to zero). In gimbal lock (x = ±90°) z is kept and y takes the rest.
    """

    def __init__(self, joints: int) -> None:
        self._last = np.zeros((joints, 3))

    def __call__(self, matrices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Angles z, x, y [rad] of the next f frames, shape (f, B, 3), from matrices (f, B, 3, 3)."""
        r = matrices
        cosine = np.hypot(r[..., 0, 1], r[..., 1, 1])
        first = np.stack(
            [
                np.arctan2(-r[..., 0, 1], r[..., 1, 1]),
                np.arctan2(r[..., 2, 1], cosine),
                np.arctan2(-r[..., 2, 0], r[..., 2, 2]),
            ],
            axis=-1,
        )
        second = first * (1.0, -1.0, 1.0) + np.pi
        out = np.empty_like(first)
        for frame in range(len(r)):
            out[frame] = self._last = self._next(first[frame], second[frame], r[frame], cosine[frame] < _LOCKED)
        return out

    def _next(
        self,
        first: NDArray[np.float64],
        second: NDArray[np.float64],
        matrices: NDArray[np.float64],
        locked: NDArray[np.bool_],
    ) -> NDArray[np.float64]:
        if locked.any():
            z = self._last[locked, 0]
            r = matrices[locked]
            # the first row of Rz(-z) R is cos y, 0, sin y
            along = np.cos(z)[:, None] * r[:, 0] + np.sin(z)[:, None] * r[:, 1]
            first, second = first.copy(), second.copy()
            first[locked] = np.stack([z, first[locked, 1], np.arctan2(along[:, 2], along[:, 0])], axis=-1)
            second[locked] = first[locked]
        a, b = self._near(first), self._near(second)
        closer = ((a - self._last) ** 2).sum(-1) <= ((b - self._last) ** 2).sum(-1)
        return np.where(closer[:, None], a, b)

    def _near(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """The same angles, shifted by whole turns to within half a turn of the previous ones."""
        return angles - _TURN * np.round((angles - self._last) / _TURN)
