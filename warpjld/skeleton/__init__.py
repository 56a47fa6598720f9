"""Joint trees, their limits, and forward kinematics (R1–R15, R27–R29)."""

from warpjld.skeleton.hand import DIGITS, PALM_SEGMENTS, PAPER_NUMBERS, hand_joint_names
from warpjld.skeleton.kinematics import (
    Poses,
    poses_from_angles,
    poses_from_rotations,
    poses_from_world,
    rest_poses,
    vertical_flexion,
)
from warpjld.skeleton.limits import default_limits
from warpjld.skeleton.tree import CHANNELS, Segment, Skeleton

__all__ = [
    "CHANNELS",
    "DIGITS",
    "PALM_SEGMENTS",
    "PAPER_NUMBERS",
    "Poses",
    "Segment",
    "Skeleton",
    "default_limits",
    "hand_joint_names",
    "poses_from_angles",
    "poses_from_rotations",
    "poses_from_world",
    "rest_poses",
    "vertical_flexion",
]
