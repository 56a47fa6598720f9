"""Playback of a rig's own animation: each joint takes the transform that the file gives it.

The rig may have been scaled and turned when it was loaded (``Rig.placing``, S below), and the animation may come from
another export of the same skeleton, placed by P. With B a joint's rest and A(t) its animated transform, both joint to
world in their files, the flesh of the joint moves by

    M(t) = S P⁻¹ A(t) B⁻¹ S⁻¹
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.geometry.scales import polar
from warpjld.listed import first_few
from warpjld.motion.joint_animation import JointAnimation
from warpjld.motion.same_skeleton import match_joints, same_bones, same_rest
from warpjld.rig import Rig
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton import Poses, poses_from_world
from warpjld.skeleton.recognise.names import read_name
from warpjld.skeleton.recognise.tree import SourceTree

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["OwnMotion", "own_poses"]

_ENOUGH = 0.5  # smallest share of a rig's joints that an animation of it must have
_WIDENED = 1e-3  # smallest change of scale of a joint's flesh that is reported
_COLLAPSED = 1e3  # scale that indicates flesh shrunk to a point at rest, which loading has reported already
_TURNED = np.radians(5.0)  # smallest own rotation of a merged joint that is reported


@dataclass(frozen=True, eq=False)
class OwnMotion:
    """Poses of a rig from an animation of its own joints.

    Attributes:
        poses: The poses.
        notes: How the joints were matched.
        warnings: What of the animation is not followed.
    """

    poses: Poses
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def own_poses(animation: JointAnimation, rig: Rig) -> OwnMotion | None:
    """Poses of a rig from an animation of its own joints, matched by name and rest; None for another skeleton.

    Flat hierarchies and moving joints are supported. Scale moves joints but does not scale the flesh; joints that
    recognition merged into another (such as twist bones) have an effect only through the joints below them. Both are
    reported where they matter.
    """
    if rig.source is None:
        return None
    match = match_joints(animation.tree, rig.source)
    joints = [j for j, source in enumerate(rig.sources) if source >= 0]
    known = [j for j in joints if match[rig.sources[j]] >= 0]
    if not known or known[0] != joints[0] or len(known) < _ENOUGH * len(joints):
        return None
    sources = np.array([rig.sources[j] for j in known])
    placed = _placed(animation, rig.source, match, sources)
    if placed is None:
        return None
    worlds, notes = placed
    # worlds: transforms of all matched joints of the file, in the file's own units and axes
    moved = np.empty((len(animation), len(rig.skeleton), 4, 4))
    moved[:, known] = _flesh(rig, worlds[:, sources], sources)
    for j, parent in enumerate(rig.skeleton.parents):
        if j not in known:  # such as an added fingertip
            moved[:, j] = moved[:, parent] if parent >= 0 else np.eye(4)
    turned, stretch = polar(moved[..., :3, :3])
    positions = np.einsum("fjab,jb->fja", moved[..., :3, :3], rig.skeleton.rest) + moved[..., :3, 3]
    rotations = transform.Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat().reshape(*moved.shape[:2], 4)
    if unknown := [rig.source.names[rig.sources[j]] for j in joints if j not in known]:
        notes.append(f"not in the animation's file, follow the joints above them: {first_few(unknown)}")
    warnings = [*_widened(rig, stretch), *_merged(rig, worlds, match, turned)]
    return OwnMotion(poses_from_world(rig.skeleton, positions, rotations), tuple(notes), tuple(warnings))


def _placed(
    animation: JointAnimation, own: SourceTree, match: NDArray[np.int64], sources: NDArray[np.int64]
) -> tuple[NDArray[np.float64], list[str]] | None:
    """Animated transforms of the rig's file joints in its world, shape (F, N, 4, 4); rest for unmatched joints."""
    known = np.flatnonzero(match >= 0)
    out = np.tile(own.frames, (len(animation), 1, 1, 1))
    placing = same_rest(animation.tree.frames[match[sources]], own.frames[sources])
    if placing is not None:
        world, frame = placing
        out[:, known] = world @ animation.worlds[:, match[known]] @ frame
        return out, []
    number = {int(j): k for k, j in enumerate(known)}
    parents = np.array([next((number[a] for a in own.ancestors(int(j)) if a in number), -1) for j in known])
    bones = same_bones(animation.tree.frames[match[known]], own.frames[known], parents)
    if bones is None:
        return None
    world, factor = bones
    theirs = animation.worlds[:, match[known]]
    for k in sorted(range(len(known)), key=lambda k: own.depth(int(known[k]))):
        if parents[k] < 0:
            out[:, known[k]] = world @ theirs[:, k]
            # the joint frames keep the scale of the rig's file
            shown = world @ animation.tree.frames[match[known[k]]]
            out[:, known[k], :3, :3] *= _size(own.frames[known[k]]) / _size(shown)
            continue
        local = np.linalg.inv(theirs[:, parents[k]]) @ theirs[:, k]
        local[:, :3, 3] *= factor
        out[:, known[k]] = out[:, known[parents[k]]] @ local
    note = "the animation's file shows another rest pose: its joints' transforms are played on this rig's bones"
    return out, [note]


def _size(frame: NDArray[np.float64]) -> float:
    """Mean scale of a transform."""
    return float(np.abs(np.linalg.det(frame[:3, :3])) ** (1.0 / 3.0))


def _flesh(rig: Rig, worlds: NDArray[np.float64], sources: NDArray[np.int64]) -> NDArray[np.float64]:
    """Transforms of joints' flesh from rest, in the rig's metres and axes, shape (F, K, 4, 4)."""
    assert rig.source is not None
    return rig.placing @ worlds @ np.linalg.inv(rig.source.frames[sources]) @ np.linalg.inv(rig.placing)


def _widened(rig: Rig, stretch: NDArray[np.float64]) -> list[str]:
    """Warning about joints whose flesh the file scales, from stretches (F, J, 3)."""
    fleshy = np.ones(len(rig.skeleton), dtype=bool)
    if rig.skin is not None:
        fleshy[:] = False
        fleshy[rig.skin.joints[rig.skin.weights > 0.01]] = True
    size = np.abs(stretch)
    off = np.abs(size - 1.0).max(axis=2) * fleshy
    told: list[tuple[str, int, float]] = []
    for j in np.flatnonzero((off > _WIDENED).any(axis=0)):
        parent = int(rig.skeleton.parents[j])
        inherited = parent >= 0 and off[:, parent].any() and np.allclose(size[:, j], size[:, parent], rtol=_WIDENED)
        if not inherited and size[:, j].max() < _COLLAPSED:
            frame = int(np.argmax(off[:, j]))
            factor = float(size[frame, j, np.argmax(np.abs(size[frame, j] - 1.0))])
            told.append((rig.source_joints[j] or rig.skeleton.names[j], frame, factor))
    if not told:
        return []
    shown = first_few([f"'{name}' to {round(factor, 6):.3g} at frame {frame}" for name, frame, factor in told])
    return [f"the animation scales {shown}: joints are placed as the file says, but the flesh keeps its size"]


def _merged(rig: Rig, worlds: NDArray[np.float64], match: NDArray[np.int64], turned: NDArray[np.float64]) -> list[str]:
    """Warning about joints of the file that were merged into another and rotate relative to it."""
    assert rig.source is not None
    of_source = {source: j for j, source in enumerate(rig.sources) if source >= 0}
    told: list[tuple[float, str]] = []
    for s, name in enumerate(rig.source.names):
        over = next((of_source[a] for a in rig.source.ancestors(s) if a in of_source), None)
        if over is None or s in of_source or match[s] < 0 or read_name(name).kind == "helper":
            continue
        own, _ = polar(_flesh(rig, worlds[:, [s]], np.array([s]))[:, 0, :3, :3])
        relative = transform.Rotation.from_matrix(np.swapaxes(turned[:, over], 1, 2) @ own)
        below = next((of_source[k] for k in rig.source.subtree(s) if k in of_source), None)
        if below is None:
            apart = float(relative.magnitude().max())
        else:  # twist is distributed along the segment by the covering
            place = (rig.placing @ rig.source.frames[s])[:3, 3]
            bone = unit(rig.skeleton.rest[below] - place)
            apart = float(np.arccos(np.clip(relative.apply(bone) @ bone, -1.0, 1.0)).max())
        if apart > _TURNED:
            told.append((apart, f"{name} ({np.degrees(apart):.0f}°, part of {rig.skeleton.names[over]})"))
    if not told:
        return []
    shown = first_few([text for _, text in sorted(told, reverse=True)])
    return [
        f"the animation turns joints that are none of this skeleton, and what flesh they have does not follow: {shown}"
    ]
