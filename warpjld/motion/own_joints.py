"""Playback of a rig's own animation: each joint takes the transform that the file gives it.

The rig may have been scaled and turned when it was loaded (``Rig.placing``, S below), and the animation may come from
another export of the same skeleton, placed by P. With B a joint's rest and A(t) its animated transform, both joint to
world in their files, the flesh of the joint moves by

    M(t) = S P⁻¹ A(t) B⁻¹ S⁻¹
"""

from __future__ import annotations

from collections.abc import Callable
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
from warpjld.skeleton.streamed_poses import streamed_rows

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
    placed = _placed(animation, rig.source, match, np.array([rig.sources[j] for j in known]))
    if placed is None:
        return None
    world_of, notes = placed

    def poses(frames: slice) -> Poses:
        moved = _moved(rig, world_of(animation[frames].worlds), known)
        turned, _ = polar(moved[..., :3, :3])
        positions = np.einsum("fjab,jb->fja", moved[..., :3, :3], rig.skeleton.rest) + moved[..., :3, 3]
        rotations = transform.Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat().reshape(*moved.shape[:2], 4)
        return poses_from_world(rig.skeleton, positions, rotations)

    if unknown := [rig.source.names[rig.sources[j]] for j in joints if j not in known]:
        notes.append(f"not in the animation's file, follow the joints above them: {first_few(unknown)}")
    widened, merged = _Widened(rig), _Merged(rig, match)
    for first, block in animation.blocks():
        worlds = world_of(block.worlds)
        turned, stretch = polar(_moved(rig, worlds, known)[..., :3, :3])
        widened.see(first, stretch)
        merged.see(worlds, turned)
    return OwnMotion(streamed_rows(len(animation), poses), tuple(notes), (*widened.warnings(), *merged.warnings()))


def _moved(rig: Rig, worlds: NDArray[np.float64], known: list[int]) -> NDArray[np.float64]:
    """Motion of every joint's flesh from rest, shape (F, J, 4, 4), from transforms of the file's joints."""
    sources = np.array([rig.sources[j] for j in known])
    moved = np.empty((len(worlds), len(rig.skeleton), 4, 4))
    moved[:, known] = _flesh(rig, worlds[:, sources], sources)
    for j, parent in enumerate(rig.skeleton.parents):
        if j not in known:  # such as an added fingertip
            moved[:, j] = moved[:, parent] if parent >= 0 else np.eye(4)
    return moved


def _placed(
    animation: JointAnimation, own: SourceTree, match: NDArray[np.int64], sources: NDArray[np.int64]
) -> tuple[Callable[[NDArray[np.float64]], NDArray[np.float64]], list[str]] | None:
    """What makes an animation's transforms (F, …, 4, 4) those of the rig's file joints in the rig's own file, shape
    (F, N, 4, 4), rest for unmatched joints; and notes."""
    known = np.flatnonzero(match >= 0)
    placing = same_rest(animation.tree.frames[match[sources]], own.frames[sources])
    if placing is not None:
        world, frame = placing

        def moved_along(worlds: NDArray[np.float64]) -> NDArray[np.float64]:
            out = np.tile(own.frames, (len(worlds), 1, 1, 1))
            out[:, known] = world @ worlds[:, match[known]] @ frame
            return out

        return moved_along, []
    number = {int(j): k for k, j in enumerate(known)}
    parents = np.array([next((number[a] for a in own.ancestors(int(j)) if a in number), -1) for j in known])
    bones = same_bones(animation.tree.frames[match[known]], own.frames[known], parents)
    if bones is None:
        return None

    def played(worlds: NDArray[np.float64]) -> NDArray[np.float64]:
        return _on_bones(worlds[:, match[known]], animation.tree.frames[match[known]], own, known, parents, *bones)

    note = "the animation's file shows another rest pose: its joints' transforms are played on this rig's bones"
    return played, [note]


def _on_bones(
    theirs: NDArray[np.float64],
    their_rest: NDArray[np.float64],
    own: SourceTree,
    known: NDArray[np.int64],
    parents: NDArray[np.int64],
    world: NDArray[np.float64],
    factor: float,
) -> NDArray[np.float64]:
    """Transforms of the rig's file joints, shape (F, N, 4, 4), from those of K known ones of another rest pose."""
    out = np.tile(own.frames, (len(theirs), 1, 1, 1))
    for k in sorted(range(len(known)), key=lambda k: own.depth(int(known[k]))):
        if parents[k] < 0:
            out[:, known[k]] = world @ theirs[:, k]
            # the joint frames keep the scale of the rig's file
            out[:, known[k], :3, :3] *= _size(own.frames[known[k]]) / _size(world @ their_rest[k])
            continue
        local = np.linalg.inv(theirs[:, parents[k]]) @ theirs[:, k]
        local[:, :3, 3] *= factor
        out[:, known[k]] = out[:, known[parents[k]]] @ local
    return out


def _size(frame: NDArray[np.float64]) -> float:
    """Mean scale of a transform."""
    return float(np.abs(np.linalg.det(frame[:3, :3])) ** (1.0 / 3.0))


def _flesh(rig: Rig, worlds: NDArray[np.float64], sources: NDArray[np.int64]) -> NDArray[np.float64]:
    """Transforms of joints' flesh from rest, in the rig's metres and axes, shape (F, K, 4, 4)."""
    assert rig.source is not None
    return rig.placing @ worlds @ np.linalg.inv(rig.source.frames[sources]) @ np.linalg.inv(rig.placing)


class _Widened:
    """Joints whose flesh the file scales."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        count = len(rig.skeleton)
        self._fleshy = np.ones(count, dtype=bool)
        if rig.skin is not None:
            self._fleshy[:] = False
            self._fleshy[rig.skin.joints[rig.skin.weights > 0.01]] = True
        self._off = np.zeros(count)  # largest change of scale; its frame and scale follow
        self._at, self._factor = np.zeros(count, dtype=np.int64), np.ones(count)
        self._largest = np.zeros(count)
        self._as_parent = np.ones(count, dtype=bool)

    def see(self, first: int, stretch: NDArray[np.float64]) -> None:
        """Record the scales (f, J, 3) of a block of frames that begins at a frame."""
        size = np.abs(stretch)
        off = np.abs(size - 1.0).max(axis=2) * self._fleshy
        frame = off.argmax(axis=0)
        joints = np.arange(len(frame))
        there = size[frame, joints]
        more = off[frame, joints] > self._off
        self._off[more], self._at[more] = off[frame, joints][more], first + frame[more]
        self._factor[more] = there[joints, np.abs(there - 1.0).argmax(axis=1)][more]
        self._largest = np.maximum(self._largest, size.max(axis=(0, 2)))
        above = np.maximum(self._rig.skeleton.parents, 0)
        self._as_parent &= np.isclose(size, size[:, above], rtol=_WIDENED).all(axis=(0, 2))

    def warnings(self) -> list[str]:
        """A warning, if any."""
        rig, found = self._rig, []
        for j in np.flatnonzero(self._off > _WIDENED).tolist():
            parent = int(rig.skeleton.parents[j])
            inherited = parent >= 0 and self._off[parent] > 0.0 and self._as_parent[j]
            if not inherited and self._largest[j] < _COLLAPSED:
                found.append((rig.source_joints[j] or rig.skeleton.names[j], self._at[j], self._factor[j]))
        if not found:
            return []
        shown = first_few([f"'{name}' to {round(factor, 6):.3g} at frame {frame}" for name, frame, factor in found])
        return [f"the animation scales {shown}: joints are placed as the file says, but the flesh keeps its size"]


class _Merged:
    """Joints of the file that were merged into another and rotate relative to it."""

    def __init__(self, rig: Rig, match: NDArray[np.int64]) -> None:
        assert rig.source is not None
        self._rig, self._source = rig, rig.source
        of_source = {source: j for j, source in enumerate(rig.sources) if source >= 0}
        self._over: dict[int, int] = {}  # joint of the file → joint of the skeleton that it is part of
        self._bones: dict[int, NDArray[np.float64]] = {}  # direction of the segment, if one begins there
        self._apart: dict[int, float] = {}
        for s, name in enumerate(rig.source.names):
            over = next((of_source[a] for a in rig.source.ancestors(s) if a in of_source), None)
            if over is None or s in of_source or match[s] < 0 or read_name(name).kind == "helper":
                continue
            self._over[s], self._apart[s] = over, 0.0
            below = next((of_source[k] for k in rig.source.subtree(s) if k in of_source), None)
            if below is not None:
                self._bones[s] = unit(rig.skeleton.rest[below] - (rig.placing @ rig.source.frames[s])[:3, 3])

    def see(self, worlds: NDArray[np.float64], turned: NDArray[np.float64]) -> None:
        """Record a block's file transforms (f, N, 4, 4) and rotations of the skeleton's joints (f, J, 3, 3)."""
        for s, over in self._over.items():
            own, _ = polar(_flesh(self._rig, worlds[:, [s]], np.array([s]))[:, 0, :3, :3])
            relative = transform.Rotation.from_matrix(np.swapaxes(turned[:, over], 1, 2) @ own)
            if s not in self._bones:
                apart = float(relative.magnitude().max())
            else:  # twist is distributed along the segment by the covering
                bone = self._bones[s]
                apart = float(np.arccos(np.clip(relative.apply(bone) @ bone, -1.0, 1.0)).max())
            self._apart[s] = max(self._apart[s], apart)

    def warnings(self) -> list[str]:
        """A warning, if any."""
        names, owners = self._source.names, self._rig.skeleton.names
        found = [
            (apart, f"{names[s]} ({np.degrees(apart):.0f}°, part of {owners[self._over[s]]})")
            for s, apart in self._apart.items()
            if apart > _TURNED
        ]
        if not found:
            return []
        shown = first_few([text for _, text in sorted(found, reverse=True)])
        return [
            f"the animation rotates joints that are not part of this skeleton, and their flesh does not follow: {shown}"
        ]
