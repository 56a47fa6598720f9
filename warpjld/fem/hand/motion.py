"""Motion of a hand's bones over time, interpolated between poses (R110)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem.hand.blend import Moves
from warpjld.fem.hand.flesh_hand import FleshHand
from warpjld.fem.load.prescribed import Prescribed
from warpjld.skeleton.kinematics import Poses

__all__ = ["FleshMotion", "halfway", "motion_of"]


@dataclass(frozen=True, eq=False)
class FleshMotion:
    """Motion of a flesh hand; ``prescribed`` and ``guess`` are called by the contact solver.

    Attributes:
        hand: The hand.
        poses: Its poses, the first one at rest.
        times: Their times, increasing from 0, shape (F,).
    """

    hand: FleshHand
    poses: Poses
    times: NDArray[np.float64]

    def pose(self, time: float) -> Poses:
        """The pose at a time; joint rotations are interpolated, so bones keep their length."""
        from scipy.spatial.transform import Rotation

        after = int(np.clip(np.searchsorted(self.times, time), 1, len(self.times) - 1))
        share = float(np.clip((time - self.times[after - 1]) / (self.times[after] - self.times[after - 1]), 0.0, 1.0))
        if share in (0.0, 1.0):
            frame = after - 1 + int(share)
            return self.poses[frame : frame + 1]
        local, offset = self._locals
        turn = Rotation.from_quat(local[after - 1])
        turn = turn * Rotation.from_rotvec(share * (turn.inv() * Rotation.from_quat(local[after])).as_rotvec())
        reach = (1.0 - share) * offset[after - 1] + share * offset[after]
        count = len(reach)
        positions, rotations = np.empty((1, count, 3)), np.empty((1, count, 4))
        turns = turn.as_quat()
        for joint, parent in enumerate(self.hand.skeleton.parents):
            if parent < 0:
                positions[0, joint], rotations[0, joint] = reach[joint], turns[joint]
            else:
                up = Rotation.from_quat(rotations[0, parent])
                positions[0, joint] = positions[0, parent] + up.apply(reach[joint])
                rotations[0, joint] = (up * Rotation.from_quat(turns[joint])).as_quat()
        rotations *= np.where(np.einsum("fji,fji->fj", rotations, self.poses.rotations[after][None]) < 0.0, -1.0, 1.0)[
            ..., None
        ]
        flexion = (1.0 - share) * self.poses.flexion[after - 1] + share * self.poses.flexion[after]
        return Poses(positions, rotations, flexion[None])

    def moves(self, time: float) -> Moves:
        """Rigid motions of the bones from rest at a time."""
        return self.hand.moves(self.pose(time))

    def prescribed(self, time: float) -> Prescribed:
        """Displacements from rest of the bones' nodes at a time."""
        return self.hand.prescribed_by(self.moves(time))

    def guess(self, before: float, time: float, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Initial guess of the displacement at ``time`` from that at ``before`` [m], shape (N, 3)."""
        return self.hand.guess(self.moves(before), self.moves(time), displacement)

    @cached_property
    def _locals(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Rotation and position of every joint relative to its parent, shapes (F, J, 4) and (F, J, 3)."""
        from scipy.spatial.transform import Rotation

        turns, offsets = self.poses.rotations.copy(), self.poses.positions.copy()
        for joint, parent in enumerate(self.hand.skeleton.parents):
            if parent >= 0:
                up = Rotation.from_quat(self.poses.rotations[:, parent]).inv()
                turns[:, joint] = (up * Rotation.from_quat(self.poses.rotations[:, joint])).as_quat()
                offsets[:, joint] = up.apply(self.poses.positions[:, joint] - self.poses.positions[:, parent])
        return turns, offsets


def motion_of(hand: FleshHand, poses: Poses, times: Sequence[float] | None = None) -> FleshMotion:
    """The motion of a hand from rest through poses.

    Args:
        hand: The hand; ``hand.placed(poses)`` where the first pose is far from rest.
        poses: F poses of its skeleton (as for the covering, not moved).
        times: Their times, increasing and above 0; 1, 2, …, F by default. At time 0 the hand is at rest.

    Raises:
        InputError: Times that do not increase, or are not as many as poses.
    """
    at = np.arange(1.0, len(poses) + 1.0) if times is None else np.asarray(times, dtype=np.float64)
    if at.shape != (len(poses),) or len(at) == 0 or not (np.diff(np.concatenate([[0.0], at])) > 0.0).all():
        raise InputError(f"times: want {len(poses)} rising times above 0, got {at.tolist()}")
    rest = hand.rest_pose()
    return FleshMotion(
        hand,
        Poses(
            np.concatenate([rest.positions, poses.positions]),
            np.concatenate([rest.rotations, poses.rotations]),
            np.concatenate([rest.flexion, poses.flexion]),
        ),
        np.concatenate([[0.0], at]),
    )


def halfway(hand: FleshHand, before: Poses, after: Poses) -> Poses:
    """The pose half-way between two, with interpolated joint rotations."""
    both = Poses(
        np.concatenate([before.positions, after.positions]),
        np.concatenate([before.rotations, after.rotations]),
        np.concatenate([before.flexion, after.flexion]),
    )
    return FleshMotion(hand, both, np.array([0.0, 1.0])).pose(0.5)
