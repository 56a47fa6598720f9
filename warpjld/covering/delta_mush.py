"""Direct delta mush (Le and Lewis 2019, variant 0), as a reference method. NumPy and SciPy, float64.

Weights and second moments of the rest surface are smoothed over it once; a frame blends them by the bones' transforms
and takes the nearest rotation of the result (polar decomposition). Written from the paper. libigl 2.5.1 computes the
same points from the same moments, but other moments: its LDLᵀ reads only the lower triangle of I + λ D⁻¹ L, which is
not symmetric, so that constants are not preserved; with that copied, its moments agree to rounding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import SuperLU, splu
from scipy.spatial.transform import Rotation

from warpjld.rig import Skin
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["delta_mush_moments", "direct_delta_mush"]

_NEGLIGIBLE = 1e-9  # entries of Ω_ij below which the joint is left out at the vertex


def delta_mush_moments(
    rest: NDArray[np.float64],
    faces: NDArray[np.int32],
    skin: Skin,
    joints: int,
    *,
    iterations: int = 20,
    rotation_step: float = 3.0,
    translation_step: float = 1.0,
    blend: float = 0.8,
) -> csr_array:
    """The matrices Ω of every vertex and joint, as 4 × 4 blocks of a sparse matrix, shape (4 V, 4 J).

    Ω_ij = (1 − α) Σ_k A_ik w_kj u_k u_kᵀ + α w'_ij p_i p_iᵀ with u = (S, 1), A = (I + λ D⁻¹ L)^−n, w' weights smoothed
    by κ in place of λ, and p_i the smoothed position; L is the cotangent Laplacian, D its diagonal.

    Args:
        rest: Rest vertices [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        skin: Painted weights.
        joints: Number of joints, J.
        iterations: Smoothing steps, n.
        rotation_step: λ.
        translation_step: κ.
        blend: α.
    """
    count = len(rest)
    weights = np.zeros((count, joints))
    np.add.at(weights, (np.arange(count)[:, None], skin.joints), skin.weights)
    centre = rest.mean(axis=0)
    homogeneous = np.column_stack([rest, np.ones(count)])
    upper = np.triu_indices(4)
    moments = homogeneous[:, upper[0]] * homogeneous[:, upper[1]]
    laplacian, diagonal = _cotangent_laplacian(rest - centre, faces)
    factor = splu((diags_array(diagonal) + rotation_step * laplacian).tocsc())
    for_weights = splu((diags_array(diagonal) + translation_step * laplacian).tocsc())

    def smooth(field: NDArray[np.float64], solver: SuperLU = factor) -> NDArray[np.float64]:
        for _ in range(iterations):
            field = solver.solve(diagonal[:, None] * field)
        return field

    placed = smooth(homogeneous)
    outer = placed[:, upper[0]] * placed[:, upper[1]]
    used = np.flatnonzero(weights.any(axis=0))
    smoothed = smooth(weights[:, used], for_weights)
    square = np.empty((4, 4), dtype=np.int64)
    square[upper] = square.T[upper] = np.arange(10)
    rows, columns, values = [], [], []
    for column, joint in enumerate(used.tolist()):
        packed = (1.0 - blend) * smooth(weights[:, joint, None] * moments) + blend * smoothed[:, column, None] * outer
        at = np.flatnonzero(np.abs(packed).max(axis=1) > _NEGLIGIBLE)
        blocks = packed[at][:, square]
        rows.append(np.broadcast_to(4 * at[:, None, None] + np.arange(4)[:, None], blocks.shape).ravel())
        columns.append(np.broadcast_to(4 * joint + np.arange(4)[None, None, :], blocks.shape).ravel())
        values.append(blocks.ravel())
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return coo_array(entries, shape=(4 * count, 4 * joints)).tocsr()


def direct_delta_mush(
    skeleton: Skeleton, rest: NDArray[np.float64], moments: csr_array, poses: Poses
) -> NDArray[np.float64]:
    """S' = R S + q − R p with [Q q; pᵀ 1] = Σ_j M_j Ω_j and R the rotation nearest to Q − q pᵀ, shape (F, V, 3).

    Args:
        skeleton: The rest skeleton.
        rest: Rest vertices [m], shape (V, 3).
        moments: From :func:`delta_mush_moments`.
        poses: F poses.
    """
    frames, count = len(poses), len(rest)
    turn = Rotation.from_quat(poses.rotations.reshape(-1, 4)).as_matrix().reshape(*poses.rotations.shape[:2], 3, 3)
    move = poses.positions - np.einsum("fjab,jb->fja", turn, skeleton.rest)
    bones = np.concatenate([turn, move[..., None]], axis=3)  # (F, J, 3, 4)
    blended = moments @ bones.transpose(1, 3, 0, 2).reshape(4 * len(skeleton), 3 * frames)
    blended = blended.reshape(count, 4, frames, 3).transpose(2, 0, 3, 1)  # (F, V, 3, 4)
    place = (moments @ np.tile([0.0, 0.0, 0.0, 1.0], len(skeleton))).reshape(count, 4)[:, :3]
    q = blended[..., 3]
    u, _, vt = np.linalg.svd(blended[..., :3] - q[..., None] * place[:, None, :])
    u[..., 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return q + np.einsum("fvab,vb->fva", u @ vt, rest - place)


def _cotangent_laplacian(
    points: NDArray[np.float64], faces: NDArray[np.int32]
) -> tuple[csr_array, NDArray[np.float64]]:
    """Cotangent Laplacian, positive semi-definite, shape (V, V), and its diagonal, with 1 at vertices of no face."""
    rows, columns, values = [], [], []
    for k in range(3):
        a, b, c = (faces[:, (k + n) % 3] for n in range(3))
        one, other = points[b] - points[a], points[c] - points[a]
        double_area = np.linalg.norm(np.cross(one, other), axis=1)
        cotangent = 0.5 * (one * other).sum(axis=1) / np.where(double_area > 0.0, double_area, np.inf)
        rows += [b, c, b, c]
        columns += [c, b, b, c]
        values += [-cotangent, -cotangent, cotangent, cotangent]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    laplacian = coo_array(entries, shape=(len(points),) * 2).tocsr()
    diagonal = laplacian.diagonal()
    return laplacian, np.where(diagonal == 0.0, 1.0, diagonal)
