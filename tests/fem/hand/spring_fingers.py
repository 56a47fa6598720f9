"""Fingers of the built-in skeleton that press springy plates: contact with a solution on paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.hand.bone_loads import BoneLoads
from warpjld.fem.hand.muscles import Effort, effort_of
from warpjld.skeleton import Poses, Skeleton, poses_from_angles


@dataclass(frozen=True)
class SpringFingers:
    """Every named digit has a plate across the way of its last phalanx's middle; its force is k × depth."""

    skeleton: Skeleton
    stiffness: dict[str, float]
    touch: NDArray[np.float64]
    """Angles [rad] at which all plates are just touched, shape (J, 4)."""

    def pad(self, digit: str, poses: Poses) -> NDArray[np.float64]:
        near, far = (self.skeleton.index(f"{digit}.{k}") for k in ("knuckle3", "tip"))
        middle: NDArray[np.float64] = 0.5 * (poses.positions[0, near] + poses.positions[0, far])
        return middle

    def normal(self, digit: str) -> NDArray[np.float64]:
        """Of the plate, against the way the pad moves when all joints flex."""
        poses = poses_from_angles(self.skeleton, self.touch[None])
        joint = self.skeleton.index(f"{digit}.knuckle2")
        axis = Rotation.from_quat(poses.rotations[0, self.skeleton.parents[joint]]).apply(self.skeleton.axes[joint])
        way = np.cross(axis, self.pad(digit, poses) - poses.positions[0, joint])
        out: NDArray[np.float64] = -way / np.linalg.norm(way)
        return out

    def effort(self, angles: NDArray[np.float64], limits: dict[str, float] | None = None) -> Effort:
        poses = poses_from_angles(self.skeleton, angles[None])
        start = poses_from_angles(self.skeleton, self.touch[None])
        tips, force, moment = [], [], []
        for digit, k in self.stiffness.items():
            pad, n = self.pad(digit, poses), self.normal(digit)
            depth = max(0.0, float((self.pad(digit, start) - pad) @ n))
            tips.append(self.skeleton.index(f"{digit}.tip"))
            force.append(k * depth * n)
            moment.append(np.cross(pad, force[-1]))
        return effort_of(self.skeleton, poses, BoneLoads(tuple(tips), np.array(force), np.array(moment)), 0, limits)
