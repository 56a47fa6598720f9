"""Bones of a baked skin: joints of the rig's own file, one for every bone of the skeleton."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, multiply
from warpjld.rig import Rig
from warpjld.skeleton.kinematics import Poses

__all__ = ["Bones", "bones_of"]


@dataclass(frozen=True, eq=False)
class Bones:
    """B joints of a rig that its skin may follow, parents first.

    Attributes:
        joints: Their indices in the skeleton, shape (B,).
        sources: Their indices in the rig's file; of a generated rig, in its skeleton, shape (B,).
        names: Their names in the file.
        parents: The nearest ancestor of each that is a bone, -1 for none, shape (B,).
        nearest: Bone that each joint of the skeleton follows, shape (J,).
        rest: Their positions at rest [m], shape (B, 3).
    """

    joints: NDArray[np.int64]
    sources: NDArray[np.int64]
    names: tuple[str, ...]
    parents: NDArray[np.int64]
    nearest: NDArray[np.int64]
    rest: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.joints)

    def moves(self, poses: Poses) -> NDArray[np.float64]:
        """Rigid transform of every bone from rest, rotation and translation [m], shape (F, B, 3, 4)."""
        turns = poses.rotations[:, self.joints]
        out = np.empty((*turns.shape[:2], 3, 4))
        out[..., :3] = Rotation.from_quat(turns.reshape(-1, 4)).as_matrix().reshape(*turns.shape[:2], 3, 3)
        out[..., 3] = poses.positions[:, self.joints] - np.einsum("fbij,bj->fbi", out[..., :3], self.rest)
        return out

    def turns(self, poses: Poses) -> NDArray[np.float64]:
        """Rotation of every bone relative to its parent, from rest, in the rest pose's axes: quaternions x, y, z, w
        with w ≥ 0, shape (F, B, 4); the identity where there is no parent."""
        world = poses.rotations[:, self.joints]
        out = multiply(conjugate(world[:, np.maximum(self.parents, 0)]), world)
        out[:, self.parents < 0] = (0.0, 0.0, 0.0, 1.0)
        return np.asarray(out * np.where(out[..., 3:] < 0.0, -1.0, 1.0))


def bones_of(rig: Rig) -> Bones:
    """The bones of a rig: joints of its file that have children in the skeleton.

    Raises:
        InputError: None of its joints is a bone.
    """
    skeleton = rig.skeleton
    count = len(skeleton)
    sources = np.array(rig.sources) if rig.source is not None else np.arange(count)
    names = rig.source.names if rig.source is not None else skeleton.names
    joints = np.array([j for j in range(count) if sources[j] >= 0 and skeleton.children[j]], dtype=np.int64)
    if not len(joints):
        raise InputError("rig: none of its file's joints is a bone that skin could follow")
    place = {int(j): b for b, j in enumerate(joints)}
    nearest = np.zeros(count, dtype=np.int64)
    parents = np.full(len(joints), -1, dtype=np.int64)
    for j, parent in enumerate(skeleton.parents.tolist()):  # parents come first
        if j in place and parent >= 0 and any(a in place for a in _above(skeleton.parents, j)):
            parents[place[j]] = nearest[parent]
        nearest[j] = place.get(j, nearest[parent] if parent >= 0 else 0)
    return Bones(
        joints, sources[joints], tuple(names[s] for s in sources[joints]), parents, nearest, skeleton.rest[joints]
    )


def _above(parents: NDArray[np.int32], joint: int) -> list[int]:
    """Ancestors of a joint, nearest first."""
    out = []
    while (joint := int(parents[joint])) >= 0:
        out.append(joint)
    return out
