"""A recorded motion of some other skeleton, before it drives a rig."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.motion.frame_times import frame_times
from warpjld.rotations import slerp

__all__ = ["Clip"]


@dataclass(frozen=True, eq=False)
class Clip:
    """F frames of a skeleton of B bones, in its file's names, units and axes.

    Attributes:
        names: The file's joint names, parents first.
        parents: Parent of every joint, -1 for a root, shape (B,).
        rest: Joint positions at rest, shape (B, 3).
        positions: Joint positions, shape (F, B, 3).
        rotations: Rotation of every bone from rest, world axes, unit quaternions x, y, z, w, shape (F, B, 4).
        rate: Frames a second.
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    rest: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    rate: float

    def __len__(self) -> int:
        return len(self.positions)

    def at_rate(self, rate: float) -> Clip:
        """The same motion at another rate: rotations interpolated spherically, positions linearly."""
        if rate == self.rate or len(self) < 2:
            return replace(self, rate=rate)
        times = np.arange(len(self)) / self.rate
        at = frame_times(0.0, times[-1], rate)
        flat = self.positions.reshape(len(self), -1)
        positions = np.stack([np.interp(at, times, column) for column in flat.T], axis=-1)
        return replace(
            self,
            positions=positions.reshape(len(at), *self.positions.shape[1:]),
            rotations=slerp(times, self.rotations, at),
            rate=rate,
        )
