"""Axis of the joint frames along which bones point: +X, +Y, -Z or any other, depending on the file."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["bone_axis", "bone_directions"]

_ALIGNED = 0.97  # smallest cosine at which a bone counts as aligned with an axis of its frame


def bone_directions(tree: SourceTree, axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """World direction of ``axis``, given in joint frames, at every joint, shape (N, 3)."""
    directions = tree.frames[:, :3, :3] @ axis
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    return directions / np.where(length > 0, length, 1.0)


def bone_axis(tree: SourceTree, pairs: list[tuple[int, int]]) -> NDArray[np.float64] | None:
    """Axis of the joint frames that bones are aligned with, from (joint, next joint) pairs; None if there is none."""
    locals_ = []
    for joint, after in pairs:
        bone = tree.positions[after] - tree.positions[joint]
        if np.linalg.norm(bone) > 0 and abs(np.linalg.det(tree.frames[joint, :3, :3])) > 0:
            locals_.append(unit(np.linalg.solve(tree.frames[joint, :3, :3], bone)))
    if len(locals_) < 3:
        return None
    mean = np.median(np.array(locals_), axis=0)
    axis = np.zeros(3)
    axis[np.argmax(np.abs(mean))] = np.sign(mean[np.argmax(np.abs(mean))])
    aligned = np.array(locals_) @ axis > _ALIGNED
    return axis if aligned.mean() > 0.7 else None
