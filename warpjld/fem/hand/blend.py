"""Rigid motions of bones, and flesh carried along by them."""

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
        """Where points (n, 3) [m] go, each with its own bone (n,)."""
        from scipy.spatial.transform import Rotation

        moved: NDArray[np.float64] = Rotation.from_quat(self.turns[bone]).apply(points) + self.shifts[bone]
        return moved

    def still(self) -> Moves:
        """No motion of as many bones."""
        return Moves(np.tile([0.0, 0.0, 0.0, 1.0], (len(self.turns), 1)), np.zeros_like(self.shifts))

    def to(self, after: Moves) -> Moves:
        """The motions that lead from here to there."""
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_quat(after.turns) * Rotation.from_quat(self.turns).inv()
        return Moves(turn.as_quat(), after.shifts - turn.apply(self.shifts))

    def blended(self, weights: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where points go under blended motions: dual quaternions (Kavan et al. 2007, doi:10.1145/1230100.1230107).

        The blend of rigid motions is rigid at every point, so nearly incompressible flesh starts a step with little
        false pressure.

        Args:
            weights: Share of the bones in the points, rows summing to one, shape (n, B).
            points: [m], shape (n, 3).
        """
        real = self.turns * _halves(self.turns, weights)[:, None]
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
    """Motions from rest of the bones that these joints (B,) carry.

    Args:
        poses: Final positions of the skeleton.
        frame: One of its frames.
        parents: Near joint of each bone.
        rest: Rest positions of the joints [m], shape (J, 3).
    """
    from scipy.spatial.transform import Rotation

    joints = list(parents)
    turn = Rotation.from_quat(poses.rotations[frame, joints])
    return Moves(turn.as_quat(), poses.positions[frame, joints] - turn.apply(rest[joints]))


def _halves(turns: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sign of each bone's quaternion, shape (B,): bones that share points turn the short way into one another.

    In a fist a fingertip turns by more than half a circle, but from bone to bone it is far less: signs go from each to
    the one that it shares most with.
    """
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    shared = weights.T @ weights
    # whoever shares nothing is tied last, by the least of weights: the tree reaches all
    links = minimum_spanning_tree(-(shared + 1e-12 * (1.0 + shared.max())))
    order, before = breadth_first_order(links, 0, directed=False)
    signs = np.ones(len(turns))
    for bone in order[1:]:
        near = before[bone]
        signs[bone] = signs[near] if turns[bone] @ turns[near] >= 0.0 else -signs[near]
    return signs
