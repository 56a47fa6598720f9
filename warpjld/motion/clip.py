"""A recorded motion of any skeleton, before retargeting."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import conjugate, multiply, rotate, slerp
from warpjld.limits import check_limit
from warpjld.motion.frame_times import frame_times

__all__ = ["Clip"]


@dataclass(frozen=True, eq=False)
class Clip:
    """F frames of a skeleton of B joints, in its file's names, units and axes.

    Attributes:
        names: The file's joint names, parents first.
        parents: Parent of every joint, -1 for a root, shape (B,).
        rest: Joint positions at rest, shape (B, 3).
        positions: Joint positions, shape (F, B, 3).
        rotations: Rotation of every bone from rest, world axes, unit quaternions x, y, z, w, shape (F, B, 4).
        rate: Frames a second.
        notes: Information for the user of the result.
        warnings: What is ignored in the file, or looks wrong.
    """

    names: tuple[str, ...]
    parents: NDArray[np.int64]
    rest: NDArray[np.float64]
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    rate: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.positions)

    def at_rate(self, rate: float) -> Clip:
        """The same motion at another rate: rotations interpolated spherically, positions linearly."""
        if rate == self.rate or len(self) < 2:
            return replace(self, rate=rate)
        times = np.arange(len(self)) / self.rate
        at = frame_times(0.0, times[-1], rate)
        check_limit("transforms", len(at) * len(self.names))
        flat = self.positions.reshape(len(self), -1)
        positions = np.stack([np.interp(at, times, column) for column in flat.T], axis=-1)
        return replace(
            self,
            positions=positions.reshape(len(at), *self.positions.shape[1:]),
            rotations=slerp(times, self.rotations, at),
            rate=rate,
        )

    def locals(self) -> NDArray[np.float64]:
        """Rotations of all bones relative to their parents', shape (F, B, 4)."""
        inner = self.parents >= 0
        out = self.rotations.copy()
        out[:, inner] = multiply(conjugate(self.rotations[:, self.parents[inner]]), self.rotations[:, inner])
        return out

    def rebased(self, frame: int, turns: NDArray[np.float64]) -> Clip:
        """The same motion with another rest pose: that of a frame, with every bone rotated back.

        With p and R the positions and rotations of joints, f the frame and H_j the rotation of bone j, the new rest's
        bones and the rotations from it are

            d'_j = H_j⁻¹ (p_child(f) − p_j(f)),   R'_j(t) = R_j(t) R_j(f)⁻¹ H_j

        Args:
            frame: Number of the frame.
            turns: H, unit quaternions, shape (B, 4).
        """
        places = self.positions[frame]
        rest = np.empty_like(self.rest)
        for j, parent in enumerate(self.parents):
            if parent < 0:
                rest[j] = rotate(conjugate(turns[j]), places[j])
            else:
                rest[j] = rest[parent] + rotate(conjugate(turns[parent]), places[j] - places[parent])
        back = multiply(conjugate(self.rotations[frame]), turns)
        return replace(self, rest=rest, rotations=multiply(self.rotations, back))

    def turned_rest(self, turn: NDArray[np.float64]) -> Clip:
        """The same motion with its rest pose rotated as a whole by a quaternion."""
        rotations = multiply(self.rotations, conjugate(turn))
        return replace(self, rest=rotate(turn, self.rest), rotations=rotations)
