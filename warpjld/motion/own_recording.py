"""Detection of BVH recordings that have a rig's own skeleton, joint by joint and with its rest pose.

BVH has joint positions but no joint frames: zero rotations give the rest pose, whose joints are placed by OFFSETs.
If a similarity T maps these positions to those of the rig's joints of the same names, the recording is an animation of
the rig's own joints. With R and p a joint's rotation from rest and its position, Q the rotation in T, and B the joint's
rest transform in the rig's file, it is

    A(t) = [ Q R(t) Qᵀ B,  T p(t) ]

The first OFFSET of a hierarchy is often 0 and its position channels give its place: T then keeps the origin.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.scales import polar
from warpjld.motion.clip import Clip
from warpjld.motion.joint_animation import JointAnimation, streamed_animation
from warpjld.motion.landmarks import Landmarks
from warpjld.motion.rest_pose import turn_of_rest
from warpjld.motion.same_skeleton import match_joints
from warpjld.rig import Rig
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton.recognise.tree import SourceTree

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["OwnRecording", "own_recording", "with_own_joints"]

_ENOUGH = 0.5  # smallest share of a rig's joints that a recording of it must have
_SAME = 1e-3
"""Tolerance of joint positions at rest, per size of the rig: some programs write three decimals of a metre."""


@dataclass(frozen=True, eq=False)
class OwnRecording:
    """A recording as an animation of a rig's own joints.

    Attributes:
        animation: Animation of those joints of the rig that the recording has.
        followed: Joints of the recording that are joints of the rig's skeleton or ancestors of one.
        notes: Decisions, for the user.
    """

    animation: JointAnimation
    followed: frozenset[int]
    notes: tuple[str, ...] = ()


def with_own_joints(rig: Rig) -> Rig:
    """A rig with a tree of its own joints: for one made without a file, those of its skeleton."""
    if rig.source is not None:
        return rig
    count = len(rig.skeleton)
    frames = np.tile(np.eye(4), (count, 1, 1))
    frames[:, :3, 3] = rig.skeleton.rest
    tree = SourceTree(rig.skeleton.names, rig.skeleton.parents.astype(np.int64), frames)
    return replace(rig, source=tree, sources=tuple(range(count)), owner=np.arange(count), placing=np.eye(4))


def own_recording(clip: Clip, rig: Rig) -> OwnRecording | None:
    """A recording as an animation of a rig's own joints; None for another skeleton or rest pose.

    Args:
        clip: The recording.
        rig: A rig with a ``source``, see ``with_own_joints``.
    """
    assert rig.source is not None
    places = rig.source.positions @ rig.placing[:3, :3].T + rig.placing[:3, 3]
    match = match_joints(_tree(clip, rig.source), rig.source)
    joints = [source for source in rig.sources if source >= 0]
    known = np.array([s for s in joints if match[s] >= 0], dtype=np.int64)
    if len(known) < max(2, _ENOUGH * len(joints)) or known[0] != joints[0]:
        return None
    fit = _similarity(clip.rest[match[known]], places[known])
    if fit is None:
        return None
    notes: tuple[str, ...] = ()
    if fit.turn.apply([0.0, 1.0, 0.0])[1] < 0.5:  # another axis is up: of the rest only, or of the frames too
        turn, notes = turn_of_rest(clip, _landmarks(clip, rig, match))
        if turn is not None:
            clip = clip.turned_rest(turn)
            fit = replace(fit, turn=fit.turn * transform.Rotation.from_quat(turn).inv())
    top = [k for k in match[match >= 0].tolist() if clip.parents[k] < 0]
    if top and not clip.rest[top].any():  # otherwise an extra node of the file, such as Reference, is at the origin
        fit = replace(fit, shift=np.zeros(3))
    own = np.flatnonzero(match >= 0)
    tree, frames_of, placed = _subtree(rig.source, own), rig.source.frames[own], fit

    def some(frames: slice) -> JointAnimation:
        return JointAnimation(tree, _worlds(clip[frames], match[own], placed, rig.placing, frames_of), clip.rate)

    used: set[int] = set()
    for k in match[known].tolist():
        while k >= 0 and k not in used:
            used.add(k)
            k = int(clip.parents[k])
    return OwnRecording(streamed_animation(len(clip), some), frozenset(used), notes)


@dataclass(frozen=True, eq=False)
class _Fit:
    """Similarity from a recording's positions to those of a rig [m]: x ↦ ``scale`` · ``turn`` x + ``shift``."""

    scale: float
    turn: transform.Rotation
    shift: NDArray[np.float64]


def _similarity(theirs: NDArray[np.float64], own: NDArray[np.float64]) -> _Fit | None:
    """The similarity that maps positions (K, 3) to others, quarter turns preferred; None if the residual is large."""
    middles = theirs.mean(axis=0), own.mean(axis=0)
    a, b = theirs - middles[0], own - middles[1]
    if not np.linalg.norm(a) > 0.0:
        return None
    scale = float(np.linalg.norm(b) / np.linalg.norm(a))
    quarter = transform.Rotation.create_group("O")
    turns = [quarter[int(k)] for k in np.argsort(quarter.magnitude(), kind="stable")]
    left, _, right = np.linalg.svd(b.T @ a)
    turns.append(transform.Rotation.from_matrix(left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right))
    near = _SAME * float(np.linalg.norm(np.ptp(own, axis=0)))
    for turn in turns:
        if np.linalg.norm(scale * turn.apply(a) - b, axis=1).max() <= near:
            return _Fit(scale, turn, middles[1] - scale * turn.apply(middles[0]))
    return None


def _worlds(
    clip: Clip,
    joints: NDArray[np.int64],
    fit: _Fit,
    placing: NDArray[np.float64],
    rest: NDArray[np.float64],
) -> NDArray[np.float64]:
    """A: joint-to-world transforms of K joints in the rig's file, shape (F, K, 4, 4); see the module's docstring."""
    shape = len(clip), len(joints)
    back = np.asarray(np.linalg.inv(placing), dtype=np.float64)
    turn, _ = polar(back[:3, :3])
    axes = turn @ fit.turn.as_matrix()
    turns = transform.Rotation.from_quat(clip.rotations[:, joints].reshape(-1, 4)).as_matrix().reshape(*shape, 3, 3)
    places = fit.scale * clip.positions[:, joints] @ fit.turn.as_matrix().T + fit.shift
    out = np.tile(np.eye(4), (*shape, 1, 1))
    out[..., :3, :3] = axes @ turns @ axes.T @ rest[:, :3, :3]
    out[..., :3, 3] = places @ back[:3, :3].T + back[:3, 3]
    return out


def _tree(clip: Clip, own: SourceTree) -> SourceTree:
    """The recording's joints; numbers that were appended to make duplicate names unique are removed."""
    doubled = {name for name, count in Counter(own.names).items() if count > 1}
    bare = [re.sub(r"_[0-9]+$", "", name) for name in clip.names]
    names = tuple(b if n not in own.names and b in doubled else n for n, b in zip(clip.names, bare, strict=True))
    frames = np.tile(np.eye(4), (len(names), 1, 1))
    frames[:, :3, 3] = clip.rest
    return SourceTree(names, clip.parents, frames)


def _subtree(tree: SourceTree, joints: NDArray[np.int64]) -> SourceTree:
    """Some joints of a tree, each a child of its nearest chosen ancestor."""
    number = {int(j): k for k, j in enumerate(joints)}
    parents = [next((number[a] for a in tree.ancestors(int(j)) if a in number), -1) for j in joints]
    return SourceTree(tuple(tree.names[j] for j in joints), np.array(parents, dtype=np.int64), tree.frames[joints])


def _landmarks(clip: Clip, rig: Rig, match: NDArray[np.int64]) -> Landmarks:
    """The recording's joints under the canonical names of the rig's."""
    named = zip(rig.skeleton.names, rig.sources, strict=True)
    joints = {name: int(match[source]) for name, source in named if source >= 0 and match[source] >= 0}
    return Landmarks(joints, clip.parents, clip.rest)
