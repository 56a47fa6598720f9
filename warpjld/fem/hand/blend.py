"""Rigid motions of bones, and their blending for the flesh by dual quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.skeleton.kinematics import Poses

__all__ = ["Moves", "moves_of"]


@dataclass(frozen=True, eq=False)
class Moves:
    """Rigid motions x → R x + t of B bones from rest.

    Attributes:
        turns: R as unit quaternions x, y, z, w, shape (B, 4).
        shifts: t [m], shape (B, 3).
    """

    turns: NDArray[np.float64]
    shifts: NDArray[np.float64]

    def of(self, bone: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions of points (n, 3) [m] moved by their bones (n,), shape (n, 3)."""
        from scipy.spatial.transform import Rotation

        moved: NDArray[np.float64] = Rotation.from_quat(self.turns[bone]).apply(points) + self.shifts[bone]
        return moved

    def still(self) -> Moves:
        """Identity for the same number of bones."""
        return Moves(np.tile([0.0, 0.0, 0.0, 1.0], (len(self.turns), 1)), np.zeros_like(self.shifts))

    def to(self, after: Moves) -> Moves:
        """The motions from these positions to those of ``after``."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_quat(after.turns) * Rotation.from_quat(self.turns).inv()
        return Moves(turn.as_quat(), after.shifts - turn.apply(self.shifts))

    def blended(self, weights: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points moved by blended motions: dual quaternions (Kavan et al. 2007, doi:10.1145/1230100.1230107).

        The blend of rigid motions is rigid at every point, so nearly incompressible flesh starts a step with little
        spurious pressure.

        Args:
            weights: Weights of the bones at the points, rows summing to one, shape (n, B).
            points: [m], shape (n, 3).
        """
        real = self.turns * _hemisphere_signs(self.turns, weights)[:, None]
        vector, scalar = real[:, :3], real[:, 3:]
        dual = 0.5 * np.concatenate(
            [
                scalar * self.shifts + np.cross(self.shifts, vector),
                -np.einsum("bi,bi->b", self.shifts, vector)[:, None],
            ],
            axis=1,
        )
        q, d = weights @ real, weights @ dual
        size = np.linalg.norm(q, axis=1, keepdims=True)
        q, d = q / size, d / size
        turned = points + 2.0 * np.cross(q[:, :3], np.cross(q[:, :3], points) + q[:, 3:] * points)
        shift = 2.0 * (q[:, 3:] * d[:, :3] - d[:, 3:] * q[:, :3] + np.cross(q[:, :3], d[:, :3]))
        out: NDArray[np.float64] = turned + shift
        return out


def moves_of(poses: Poses, frame: int, parents: Sequence[int], rest: NDArray[np.float64]) -> Moves:
    """Rigid motions from rest of the bones that these joints (B,) carry.

    Args:
        poses: Poses of the skeleton.
        frame: Frame of the poses.
        parents: Proximal joint of each bone.
        rest: Rest positions of the joints [m], shape (J, 3).
    """
    from scipy.spatial.transform import Rotation

    joints = list(parents)
    turn = Rotation.from_quat(poses.rotations[frame, joints])
    return Moves(turn.as_quat(), poses.positions[frame, joints] - turn.apply(rest[joints]))


def _hemisphere_signs(turns: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sign of each bone's quaternion, shape (B,), such that bones that share points blend along the shorter arc.

    In a fist a fingertip is rotated by more than half a turn from rest, but from bone to bone by far less: signs are
    propagated from each bone to the one with most shared weight (a spanning tree).
    """
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    shared = weights.T @ weights
    # a small constant links bones without shared weight, so that the tree is connected
    links = minimum_spanning_tree(-(shared + 1e-12 * (1.0 + shared.max())))
    order, before = breadth_first_order(links, 0, directed=False)
    signs = np.ones(len(turns))
    for bone in order[1:]:
        near = before[bone]
        signs[bone] = signs[near] if turns[bone] @ turns[near] >= 0.0 else -signs[near]
    return signs
