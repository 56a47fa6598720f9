"""Forward kinematics: joint angles of many frames → joint positions, bone rotations and vertical flexions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, multiply, rotate
from warpjld.skeleton.channels import CHANNELS, channel_rotations
from warpjld.skeleton.tree import Skeleton

__all__ = [
    "Poses",
    "joint_rotations",
    "poses_beside_rest",
    "poses_from_angles",
    "poses_from_rotations",
    "poses_from_world",
    "rest_poses",
    "vertical_flexion",
]


@dataclass(frozen=True, eq=False)
class Poses:
    """Posed skeletons over F frames: all that the covering needs.

    Attributes:
        positions: Joint positions [m], shape (F, J, 3).
        rotations: Rotation of each joint's bone from the rest pose, unit quaternions x, y, z, w, shape (F, J, 4).
            Signs are aligned along the tree, so that blending two neighbours takes the shorter arc.
        flexion: Vertical component of each joint's flexion [rad], shape (F, J) (R28, R29).

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> motion = wj.Motion()
        >>> motion.set_key("index.base.flexion", 0, 0.0)
        >>> motion.set_key("index.base.flexion", 10, 1.2)  # rad
        >>> poses = motion.poses(hand.skeleton)
        >>> poses
        Poses(11 frames of 26 joints)
        >>> poses[5:].positions.shape
        (6, 26, 3)
    """

    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    flexion: NDArray[np.float64]

    def __repr__(self) -> str:
        frames = len(self)
        return f"Poses({frames} frame{'s' * (frames != 1)} of {self.positions.shape[1]} joints)"

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, frames: slice) -> Poses:
        return Poses(self.positions[frames], self.rotations[frames], self.flexion[frames])


def poses_from_angles(
    skeleton: Skeleton,
    angles: NDArray[np.float64],
    *,
    root_position: NDArray[np.float64] | None = None,
    root_rotation: NDArray[np.float64] | None = None,
) -> Poses:
    """Poses of joint angles.

    A joint turns its bone by twisting about the segment, then flexion about the pivoted axis (R27), then abduction
    about the normal; pivot, twisting and abduction are mirrored on the left side, so that equal angles give mirrored
    hands: positive pivot and abduction lean to the thumb's side, positive twisting is inward rotation. Angles count
    from straight joints: those of the rest pose are the skeleton's initial ones (R25).

    Args:
        skeleton: The rest skeleton.
        angles: Joint angles [rad], shape (F, J, 4), channels as in ``CHANNELS``.
        root_position: Displacement of the root from rest [m], shape (F, 3).
        root_rotation: Rotation of the root about its rest position, quaternions x, y, z, w, shape (F, 4).

    Raises:
        InputError: Wrong shapes, or angles that are not finite.

    Examples:
        >>> import numpy as np
        >>> skeleton = wj.build_hand("left", resolution=1500).skeleton
        >>> angles = np.zeros((2, len(skeleton), 4))
        >>> angles[1, skeleton.index("index.base"), 0] = np.radians(70)  # flexion
        >>> wj.poses_from_angles(skeleton, angles)
        Poses(2 frames of 26 joints)
    """
    count = len(skeleton)
    if angles.ndim != 3 or angles.shape[1:] != (count, len(CHANNELS)):
        raise InputError(f"angles: want shape (frames, {count}, {len(CHANNELS)}), got {angles.shape}")
    if not np.isfinite(angles).all():
        frame, joint, channel = np.argwhere(~np.isfinite(angles))[0]
        raise InputError(f"angles: {skeleton.names[joint]}.{CHANNELS[channel]} is not finite at frame {frame}")
    return _compose(skeleton, joint_rotations(skeleton, angles), root_position, root_rotation)


def joint_rotations(
    skeleton: Skeleton, angles: NDArray[np.float64], *, joints: NDArray[np.integer] | None = None
) -> NDArray[np.float64]:
    """Rotations of joints from rest relative to their parents' bones, in the axes of the rest pose, shape (F, K, 4).

    Args:
        skeleton: The rest skeleton.
        angles: Joint angles [rad], shape (F, K, 4), channels as in ``CHANNELS``.
        joints: Joint indices that ``angles`` belongs to, shape (K,); all joints by default.
    """
    chosen = slice(None) if joints is None else joints
    axes, directions, mirror = skeleton.axes[chosen], skeleton.directions[chosen], skeleton.mirror[chosen, None]
    turned = channel_rotations(angles, axes, directions, mirror, skeleton.normals[chosen])
    if skeleton.initial_turns is None:
        return turned
    return np.asarray(multiply(conjugate(skeleton.initial_turns[chosen]), turned))


def poses_from_rotations(
    skeleton: Skeleton,
    local: NDArray[np.float64],
    *,
    root_position: NDArray[np.float64] | None = None,
) -> Poses:
    """Poses of free joint rotations, such as a motion file gives (BVH, glTF).

    Args:
        skeleton: The rest skeleton.
        local: Rotation of each joint relative to its parent's bone, measured from rest in the axes of the rest pose,
            quaternions x, y, z, w, shape (F, J, 4).
        root_position: Displacement of the root from rest [m], shape (F, 3).

    Raises:
        InputError: Wrong shapes.
    """
    if local.ndim != 3 or local.shape[1:] != (len(skeleton), 4):
        raise InputError(f"local: want shape (frames, {len(skeleton)}, 4), got {local.shape}")
    return _compose(skeleton, local, root_position, None)


def poses_from_world(skeleton: Skeleton, positions: NDArray[np.float64], rotations: NDArray[np.float64]) -> Poses:
    """Poses of joints whose world transforms are given, so that bones may change their length.

    Args:
        skeleton: The rest skeleton.
        positions: Joint positions [m], shape (F, J, 3).
        rotations: Rotation of each joint's bone from the rest pose, in world axes, unit quaternions x, y, z, w of
            either sign, shape (F, J, 4).

    Raises:
        InputError: Wrong shapes.
    """
    count = len(skeleton)
    for name, array, last in (("positions", positions, 3), ("rotations", rotations, 4)):
        if array.ndim != 3 or array.shape[1:] != (count, last):
            raise InputError(f"{name}: want shape (frames, {count}, {last}), got {array.shape}")
    local = rotations.copy()
    for j, parent in enumerate(skeleton.parents):
        if parent >= 0:
            local[:, j] = multiply(conjugate(rotations[:, parent]), rotations[:, j])
    local *= np.where(local[..., 3:] < 0.0, -1.0, 1.0)
    aligned = local.copy()
    for j, parent in enumerate(skeleton.parents):
        if parent >= 0:
            aligned[:, j] = multiply(aligned[:, parent], local[:, j])
    return Poses(np.array(positions, dtype=np.float64), aligned, vertical_flexion(skeleton, local))


def rest_poses(skeleton: Skeleton, frames: int = 1) -> Poses:
    """The rest pose, ``frames`` times."""
    return poses_from_angles(skeleton, np.repeat(skeleton.initial[None], frames, axis=0))


def poses_beside_rest(skeleton: Skeleton, angles: NDArray[np.float64]) -> Poses:
    """Poses in which some joints have angles [rad], shape (F, J, 4); those whose angles are all 0 are at rest."""
    return poses_from_angles(skeleton, np.where(angles.any(axis=-1, keepdims=True), angles, skeleton.initial))


def _compose(
    skeleton: Skeleton,
    local: NDArray[np.float64],
    root_position: NDArray[np.float64] | None,
    root_rotation: NDArray[np.float64] | None,
) -> Poses:
    frames, count = local.shape[:2]
    local = local * np.where(local[..., 3:] < 0.0, -1.0, 1.0)
    rotations = np.empty((frames, count, 4))
    positions = np.empty((frames, count, 3))
    for joints, parents in skeleton.levels:
        if parents[0] < 0:
            turn = local[:, joints] if root_rotation is None else multiply(root_rotation[:, None], local[:, joints])
            rotations[:, joints] = turn
            positions[:, joints] = skeleton.rest[joints] + (0.0 if root_position is None else root_position[:, None])
        else:
            rotations[:, joints] = multiply(rotations[:, parents], local[:, joints])
            offset = rotate(rotations[:, parents], skeleton.rest[joints] - skeleton.rest[parents])
            positions[:, joints] = positions[:, parents] + offset
    return Poses(positions, rotations, vertical_flexion(skeleton, local))


def vertical_flexion(skeleton: Skeleton, local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle [rad] between a joint's straight segment and the projection of its final segment on the plane normal to the
    unpivoted flexion axis, shape (F, J) (A §3, R28, R29).

    Args:
        skeleton: The rest skeleton.
        local: Joint rotations relative to the parent's bone, quaternions x, y, z, w, shape (F, J, 4).
    """
    initial, level, bends = skeleton.bending_planes
    moved = rotate(local, skeleton.directions)
    angle = np.arctan2((moved * level).sum(axis=-1), (moved * initial).sum(axis=-1))
    return np.asarray(np.where(bends, angle, 0.0))
