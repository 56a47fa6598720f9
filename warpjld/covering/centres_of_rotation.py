"""Skinning with optimised centres of rotation (Le and Hodgins 2016), as a reference method. NumPy, float64.

Every vertex turns by the blended quaternions of its joints about a centre that moves by linear blending. The centre is
the mean of the surface weighted by similarity of skinning weights, so that vertices with similar weights turn about the
same point. Written from the paper, without its subdivision of faces whose corners differ much in weights.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.baselines import linear_blend_skinning
from warpjld.geometry.rotations import rotate, unit
from warpjld.rig import Skin
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["centre_of_rotation_skinning", "centres_of_rotation"]

_WIDTH = 0.1  # σ of the similarity (the paper's)
_CHUNK = 2_000_000  # vertex × face pairs at a time, which bounds memory


def centres_of_rotation(rest: NDArray[np.float64], faces: NDArray[np.int32], skin: Skin) -> NDArray[np.float64]:
    """Centre of every vertex [m], shape (V, 3): p = ∫ s(w_v, w_x) x dx / ∫ s(w_v, w_x) dx over the surface (eq. 1),

    s(a, b) = Σ_{j≠k} a_j a_k b_j b_k exp(−(a_j b_k − a_k b_j)² / σ²), with the weights of a face the mean of its
    corners'. For a vertex with the weight of a single joint the integral is zero; its centre is the vertex itself.

    Args:
        rest: Rest vertices [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        skin: Painted weights.
    """
    joints = int(skin.joints.max()) + 1
    weights = np.zeros((len(rest), joints))
    np.add.at(weights, (np.arange(len(rest))[:, None], skin.joints), skin.weights)
    corners = rest[faces]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    moment = np.column_stack([area[:, None] * corners.mean(axis=1), area])
    of_face = weights[faces].mean(axis=1)
    total = np.zeros((len(rest), 4))
    together = (weights > 0.0).astype(np.float64).T @ (weights > 0.0)
    for j, k in np.argwhere(np.triu(together, 1) > 0.0).tolist():
        vertex = np.flatnonzero((weights[:, j] > 0.0) & (weights[:, k] > 0.0))
        face = np.flatnonzero((of_face[:, j] > 0.0) & (of_face[:, k] > 0.0))
        b_j, b_k = of_face[face, j], of_face[face, k]
        step = max(_CHUNK // max(len(face), 1), 1)
        for first, last in pairwise([*range(0, len(vertex), step), len(vertex)]):
            chunk = vertex[first:last]
            a_j, a_k = weights[chunk, j, None], weights[chunk, k, None]
            similarity = np.exp(-(((a_j * b_k - a_k * b_j) / _WIDTH) ** 2))
            total[chunk] += a_j * a_k * (similarity * (b_j * b_k)) @ moment[face]
    found = total[:, 3] > 0.0
    return np.where(found[:, None], total[:, :3] / np.where(found, total[:, 3], 1.0)[:, None], rest)


def centre_of_rotation_skinning(
    skeleton: Skeleton,
    rest: NDArray[np.float64],
    skin: Skin,
    centres: NDArray[np.float64],
    poses: Poses,
) -> NDArray[np.float64]:
    """S' = rot(normalise(Σ ± w_j q_j), S − p) + LBS(p) [m], shape (F, V, 3), LBS linear blend skinning.

    Quaternions are blended with the sign that lies nearest to the one of the joint with the largest weight.

    Args:
        skeleton: The rest skeleton.
        rest: Rest vertices [m], shape (V, 3).
        skin: Painted weights.
        centres: From :func:`centres_of_rotation`, shape (V, 3).
        poses: F poses.
    """
    quaternions = poses.rotations
    pivot = quaternions[:, skin.joints[np.arange(len(rest)), skin.weights.argmax(axis=1)]]
    blended = np.zeros_like(pivot)
    for k in range(skin.joints.shape[1]):
        own = quaternions[:, skin.joints[:, k]]
        sign = np.where((own * pivot).sum(axis=2) < 0.0, -1.0, 1.0)
        blended += (skin.weights[:, k] * sign)[..., None] * own
    return rotate(unit(blended), rest - centres) + linear_blend_skinning(skeleton, centres, skin, poses)
