"""A baked rig: skin weights on the rig's own joints, corrective shapes, and its deformation as engines compute it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array

from warpjld.baking.bones import Bones, bones_of
from warpjld.baking.correctives import Correctives, fit_correctives, no_correctives
from warpjld.baking.weights import fit_weights
from warpjld.covering.covering import Covering
from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.skeleton.kinematics import Poses

__all__ = ["Baked", "bake"]

_MOST_CORRECTIVES = 128  # upper bound of the number of shapes, against typing errors
_FRAMES = 16  # frames skinned at once


@dataclass(frozen=True, eq=False)
class Baked:
    """Linear blend skinning of a surface to which corrective shapes are added first.

    Attributes:
        rig: The rig it was made for.
        bones: The joints that the skin follows.
        joints: Bones of every welded vertex, by descending weight, shape (V, influences).
        weights: Their weights, rows summing to one, shape (V, influences).
        correctives: The corrective shapes.
    """

    rig: Rig
    bones: Bones
    joints: NDArray[np.int64]
    weights: NDArray[np.float64]
    correctives: Correctives

    def __repr__(self) -> str:
        shapes = len(self.correctives)
        return f"Baked('{self.rig.name}': {self.joints.shape[1]} joints a vertex, {shapes} corrective shapes)"

    def blended(self, poses: Poses) -> NDArray[np.float64]:
        """Every vertex's blend of the bones' transforms from rest, shape (F, V, 3, 4)."""
        moves = self.bones.moves(poses)
        out = np.zeros((len(poses), len(self.joints), 3, 4))
        for k in range(self.joints.shape[1]):
            out += self.weights[:, k, None, None] * moves[:, self.joints[:, k]]
        return out

    def deform(self, poses: Poses, *, corrected: bool = True) -> NDArray[np.float64]:
        """Positions of the welded vertices [m], shape (F, V, 3), float64.

        Args:
            poses: F poses of the rig's skeleton.
            corrected: Whether corrective shapes are added.
        """
        rest = self.rig.surface.vertices
        out = np.empty((len(poses), *rest.shape))
        shape_weights = self.correctives.weights(self.bones.turns(poses))
        for start in range(0, len(poses), _FRAMES):
            part = slice(start, start + _FRAMES)
            at = np.broadcast_to(rest, out[part].shape)
            if corrected and len(self.correctives):
                at = at + np.tensordot(shape_weights[part], self.correctives.shapes, 1)
            matrices = self.blended(poses[part])
            out[part] = np.einsum("fvij,fvj->fvi", matrices[..., :3], at) + matrices[..., 3]
        return out


def bake(
    rig: Rig,
    covering: Covering,
    poses: Poses,
    *,
    influences: int = 4,
    correctives: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Baked:
    """Fit skin weights and corrective shapes to the deformation by a covering.

    Args:
        rig: The rig; its joints and bind pose are kept.
        covering: Its covering.
        poses: Poses to fit to.
        influences: Largest number of joints per vertex, 4 or 8.
        correctives: Number of corrective shapes, 0 … 128.
        progress: Called with the name of the phase, its steps done, and the number of its steps.

    Raises:
        InputError: Influences or correctives out of range, fewer poses than shapes, or poses of another rig.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> motion = wj.Motion()
        >>> motion.set_key("index.base.flexion", 0, 0.0)
        >>> motion.set_key("index.base.flexion", 10, 1.2)  # rad
        >>> baked = wj.bake(hand, wj.bind(hand), motion.poses(hand.skeleton))
        >>> baked
        Baked('left hand': 4 joints a vertex, 0 corrective shapes)
    """
    if influences not in (4, 8):
        raise InputError(f"influences: want 4 or 8, got {influences}")
    if not 0 <= correctives <= _MOST_CORRECTIVES:
        raise InputError(f"correctives: want 0 … {_MOST_CORRECTIVES}, got {correctives}")
    if len(poses) < max(correctives, 1):
        raise InputError(f"poses: want at least {max(correctives, 1)} to fit on, got {len(poses)}")
    covering.check(poses)
    if len(covering.skeleton) != len(rig.skeleton) or covering.surface.vertices.shape != rig.surface.vertices.shape:
        raise InputError("covering: want one of this rig's skeleton and surface, got another rig's")
    bones = bones_of(rig)
    targets = covering.deform(poses)
    rest = rig.surface.vertices
    joints, weights = fit_weights(rest, targets, bones.moves(poses), bones.parents, influences, progress)
    if rig.rigid is not None and (is_rigid := rig.rigid >= 0).any():
        joints[is_rigid], weights[is_rigid] = 0, 0.0
        joints[is_rigid, 0], weights[is_rigid, 0] = bones.nearest[rig.rigid[is_rigid]], 1.0
    # rounded to single precision, as in files
    weights = weights.astype(np.float32).astype(np.float64)
    plain = Baked(rig, bones, joints, weights, no_correctives(len(rest), len(bones)))
    if not correctives:
        return plain
    if progress:
        progress("corrective shapes", 0, 1)
    errors = np.empty(targets.shape)
    linear = np.empty((*targets.shape, 3), dtype=np.float32)
    for start in range(0, len(poses), _FRAMES):
        part = slice(start, start + _FRAMES)
        matrices = plain.blended(poses[part])
        linear[part] = matrices[..., :3]
        errors[part] = targets[part] - np.einsum("fvij,vj->fvi", matrices[..., :3], rest) - matrices[..., 3]
    skin = coo_array(
        (weights.ravel(), (np.repeat(np.arange(len(rest)), influences), joints.ravel())), shape=(len(rest), len(bones))
    ).tocsc()
    skin.eliminate_zeros()
    found = fit_correctives(errors, linear, bones.turns(poses), skin, correctives)
    if progress:
        progress("corrective shapes", 1, 1)
    return Baked(rig, bones, joints, weights, found)
