"""A capture of a rig's own skeleton: a BVH that rests where the rig does is played joint by joint, not retargeted.

BVH states no axes of joints, only where they rest and how they turn from there. With W the similarity that brings the
file's rest on the rig's, a joint at p(t) turned by R(t) that has the frame B in the rig's file is at

    A(t) = W (p(t), R(t)) W⁻¹ B
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.motion.clip import Clip
from warpjld.motion.joint_animation import JointAnimation
from warpjld.motion.same_skeleton import match_joints
from warpjld.rig import Rig
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["own_capture"]

_SAME = 3e-4
"""Rests that differ by less, relative to the skeleton's size, are one: offsets are written with a few decimals."""
_ENOUGH = 0.5  # share of a rig's joints that a capture of its own must know
_FEWEST = 4  # joints, not on one line, that fix how a rest is turned
_FLAT = 0.02  # of their size: what counts as on one line


def own_capture(clip: Clip, rig: Rig) -> tuple[JointAnimation, frozenset[int]] | None:
    """A capture as an animation of the rig's own joints; None where names or rests are another skeleton's.

    Returns:
        The animation, and the capture's joints that drive a joint of the rig, or carry one that does.
    """
    own = rig.source
    if own is None:
        return None
    frames = np.tile(np.eye(4), (len(clip.names), 1, 1))
    frames[:, :3, 3] = clip.rest
    match = match_joints(SourceTree(clip.names, clip.parents, frames), own)
    sources = [s for s in rig.sources if s >= 0]
    known = [s for s in sources if match[s] >= 0]
    if len(known) < max(_FEWEST, _ENOUGH * len(sources)) or known[0] != sources[0]:
        return None
    rests = _similarity(clip.rest[match[known]], own.positions[known])
    if rests is None:
        return None
    turn, scale, moves = rests
    first = int(match[known[0]])
    # many write 0 for the root's OFFSET, and where it stands in the world in its channels
    places = [scale * clip.positions[0, first] @ turn.T + move - own.positions[known[0]] for move in moves]
    move = moves[int(np.linalg.norm(places[1]) < np.linalg.norm(places[0]))]
    worlds = np.tile(own.frames, (len(clip), 1, 1, 1))
    for j in sorted(range(len(own)), key=own.depth):
        k, parent = int(match[j]), int(own.parents[j])
        if k >= 0:
            turned = turn @ Rotation.from_quat(clip.rotations[:, k]).as_matrix() @ turn.T
            worlds[:, j, :3, :3] = turned @ own.frames[j, :3, :3]
            worlds[:, j, :3, 3] = scale * clip.positions[:, k] @ turn.T + move
        elif parent >= 0:
            worlds[:, j] = worlds[:, parent] @ np.linalg.pinv(own.frames[parent]) @ own.frames[j]
    used: set[int] = set()
    for k in match[known]:
        while k >= 0 and int(k) not in used:
            used.add(int(k))
            k = clip.parents[k]
    notes = [*clip.notes, "the recording is of this rig's own skeleton: its joints are played as they are"]
    if lacking := [own.names[s] for s in sources if match[s] < 0]:
        notes.append(f"not in the recording, these follow the joints above them: {', '.join(lacking)}")
    return JointAnimation(own, worlds, clip.rate, notes=tuple(notes)), frozenset(used)


def _similarity(
    theirs: NDArray[np.float64], own: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float, tuple[NDArray[np.float64], NDArray[np.float64]]] | None:
    """What brings rest places (K, 3) on those of a rig, ``scale * turn @ p + move``: a turn of axes into axes.

    Returns:
        Turn (3, 3), scale, and the move, likelier first: none, and the one that the rests differ by. None where
        nothing brings them together, or they lie on a line.
    """
    middle = [places - places.mean(axis=0) for places in (theirs, own)]
    size = float(np.linalg.norm(np.ptp(own, axis=0)))
    lengths = np.linalg.svd(middle[1], compute_uv=False)
    if not (np.linalg.norm(middle[0]) > 0.0 and lengths[1] > _FLAT * lengths[0]):
        return None
    scale = float(np.linalg.norm(middle[1]) / np.linalg.norm(middle[0]))
    turns = Rotation.create_group("O").as_matrix()
    off = [float(np.abs(scale * middle[0] @ turn.T - middle[1]).max()) for turn in turns]
    best = int(np.argmin(off))
    if off[best] > _SAME * size:
        return None
    turn = np.round(turns[best])
    return turn, scale, (np.zeros(3), own.mean(axis=0) - scale * theirs.mean(axis=0) @ turn.T)
