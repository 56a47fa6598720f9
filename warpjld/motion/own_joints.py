"""A rig's own animation: each joint takes the transform that the file gives it, whatever was guessed on loading.

The rig may have been scaled and turned when it was loaded (``Rig.placing``, S below), and the animation may come from
another export of the same skeleton, placed by P. With B a joint's rest and A(t) its animated transform, both joint to
world in their files, the flesh on it moves by

    M(t) = S P⁻¹ A(t) B⁻¹ S⁻¹
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.motion.joint_animation import JointAnimation
from warpjld.rig import Rig
from warpjld.skeleton import Poses, poses_from_world
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["own_poses"]

_SAME = 1e-4
"""Rest transforms that differ by less, relative to the skeleton's size, are those of one skeleton."""


def own_poses(animation: JointAnimation, rig: Rig) -> Poses | None:
    """Poses of a rig whose own joints, by name and rest, an animation moves; None where they are another skeleton's.

    Flat hierarchies and joints that move are followed. Scale moves joints, but does not widen the flesh; joints that
    recognition merged into another (twist bones, say) only count by where they carry the joints below them.
    """
    if rig.source is None:
        return None
    joints = [j for j, source in enumerate(rig.sources) if source >= 0]
    sources = [rig.sources[j] for j in joints]
    where = _same_joints(animation.tree, rig.source, sources)
    if where is None:
        return None
    own, theirs = rig.source.frames[sources], animation.tree.frames[where]
    placing = own[0] @ np.linalg.inv(theirs[0])
    if not _same_rest(placing @ theirs, own):
        return None
    into = rig.placing @ placing
    moved = np.empty((len(animation), len(rig.skeleton), 4, 4))
    moved[:, joints] = into @ animation.worlds[:, where] @ np.linalg.inv(own) @ np.linalg.inv(rig.placing)
    for j, parent in enumerate(rig.skeleton.parents):
        if rig.sources[j] < 0:  # an added fingertip, say
            moved[:, j] = moved[:, parent] if parent >= 0 else np.eye(4)
    rotations = Rotation.from_matrix(moved[..., :3, :3].reshape(-1, 3, 3)).as_quat().reshape(*moved.shape[:2], 4)
    positions = np.einsum("fjab,jb->fja", moved[..., :3, :3], rig.skeleton.rest) + moved[..., :3, 3]
    return poses_from_world(rig.skeleton, positions, rotations)


def _same_joints(theirs: SourceTree, own: SourceTree, wanted: list[int]) -> list[int] | None:
    """Joints of the animation with the names of the rig's wanted ones; None unless all are there."""
    if theirs.names == own.names:
        return wanted
    number = {name: j for j, name in enumerate(theirs.names)}
    found = [number.get(own.names[j], -1) for j in wanted]
    return None if -1 in found else found


def _same_rest(theirs: NDArray[np.float64], own: NDArray[np.float64]) -> bool:
    off = np.abs(theirs - own)
    size = float(np.linalg.norm(np.ptp(own[:, :3, 3], axis=0))) or 1.0
    return bool(off[:, :3, 3].max() <= _SAME * size and off[:, :3, :3].max() <= _SAME * np.abs(own[:, :3, :3]).max())
