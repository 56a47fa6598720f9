"""Reference skinning methods with painted weights: linear blend and dual quaternions. NumPy, float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.rig import Skin
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["dual_quaternion_skinning", "linear_blend_skinning"]


def linear_blend_skinning(
    skeleton: Skeleton, rest: NDArray[np.float64], skin: Skin, poses: Poses
) -> NDArray[np.float64]:
    """Linear blend skinning, S' = Σ w_j (rot(q_j, S − J_j) + J_j') [m], shape (F, V, 3).

    Args:
        skeleton: The rest skeleton.
        rest: Rest vertices [m], shape (V, 3).
        skin: Painted weights.
        poses: F poses.
    """
    turn = Rotation.from_quat(poses.rotations.reshape(-1, 4)).as_matrix().reshape(*poses.rotations.shape[:2], 3, 3)
    move = poses.positions - np.einsum("fjab,jb->fja", turn, skeleton.rest)
    out = np.zeros((len(poses), len(rest), 3))
    for k in range(skin.joints.shape[1]):
        joint, weight = skin.joints[:, k], skin.weights[:, k]
        moved = np.einsum("fvab,vb->fva", turn[:, joint], rest) + move[:, joint]
        out += weight[:, None] * moved
    return out


def dual_quaternion_skinning(
    skeleton: Skeleton, rest: NDArray[np.float64], skin: Skin, poses: Poses
) -> NDArray[np.float64]:
    """Skinning by the normalised blend of unit dual quaternions [m], shape (F, V, 3) (Kavan et al., *Skinning with
    Dual Quaternions*, 2007).

    Arguments as for :func:`linear_blend_skinning`. Quaternions are blended with the sign that lies nearest to the one
    of the joint with the largest weight.
    """
    real = poses.rotations
    move = poses.positions - Rotation.from_quat(real.reshape(-1, 4)).apply(
        np.tile(skeleton.rest, (len(poses), 1))
    ).reshape(poses.positions.shape)
    dual = _half_product(move, real)
    pivot = real[:, skin.joints[np.arange(len(rest)), skin.weights.argmax(axis=1)]]
    blended, blended_dual = (np.zeros((len(poses), len(rest), 4)) for _ in range(2))
    for k in range(skin.joints.shape[1]):
        joint = skin.joints[:, k]
        sign = np.where((real[:, joint] * pivot).sum(axis=2) < 0.0, -1.0, 1.0)
        weight = (skin.weights[:, k] * sign)[..., None]
        blended += weight * real[:, joint]
        blended_dual += weight * dual[:, joint]
    length = np.linalg.norm(blended, axis=2, keepdims=True)
    blended, blended_dual = blended / length, blended_dual / length
    turned = Rotation.from_quat(blended.reshape(-1, 4)).apply(np.tile(rest, (len(poses), 1)))
    real_vector, real_scalar = blended[..., :3], blended[..., 3:]
    dual_vector, dual_scalar = blended_dual[..., :3], blended_dual[..., 3:]
    return np.asarray(
        turned.reshape(len(poses), -1, 3)
        + 2.0 * (real_scalar * dual_vector - dual_scalar * real_vector + np.cross(real_vector, dual_vector))
    )


def _half_product(move: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Dual part ½ t q of unit dual quaternions, from translations (…, 3) and quaternions (…, 4)."""
    vector, scalar = turn[..., :3], turn[..., 3:]
    return 0.5 * np.concatenate(
        [scalar * move + np.cross(move, vector), -(move * vector).sum(axis=-1, keepdims=True)], axis=-1
    )
