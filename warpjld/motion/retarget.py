"""Retargeting of a recorded motion of another skeleton to a rig: rotations are transferred, bone lengths are the rig's.

The rest poses differ: recordings mostly rest in a T-pose, rigs in an A-pose. With R the recorded rotation of a bone
from its rest, and A the alignment of the rig's rest pose with the recording's, the rig's bone is rotated by

    Q(t) = W R(t) Wᵀ A

where W rotates the recording's axes to the rig's (up and left may be other axes there). A is computed along the tree:
the parent's A followed by the minimal rotation of the rig's rest bone to the recording's,

    A_j = minimal(A_parent d_rig → W d_recording) A_parent

so a limb's bone points exactly where the recorded one does, and knees and elbows keep their plane of flexion.
If both have a thumb, the hand is further rotated about its axis until the thumbs are on the same side. There are three
exceptions, where rest directions reflect how a skeleton was modelled more than its pose: the trunk (A = 1, rotations
interpolated along the spine, for any numbers of vertebrae), the clavicles (A = 1) and the feet (only the heading is
aligned, so that flat soles stay flat). Joints without counterpart follow their parent.

A recording may subdivide limbs, or move joints along or across bones: R of a limb's segment is the rotation of the last
part of an upper arm or thigh, or the first part of a forearm or shin, followed by the minimal rotation of the segment
to the line between the *joints* at its ends in each frame. An unusable rest pose is replaced first, see
:mod:`warpjld.motion.rest_pose`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import axis_turns, conjugate, matrices, minimal_rotation, multiply, rotate, slerp, unit
from warpjld.motion.clip import Clip
from warpjld.motion.landmarks import Landmarks
from warpjld.motion.pairs import limb_names, pair_joints
from warpjld.skeleton import Poses, Skeleton, poses_from_rotations
from warpjld.skeleton.streamed_poses import streamed_rows

__all__ = ["Retargeted", "correspondence", "retarget", "retarget_and_tell"]

_IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])
_GROUND_PERCENTILE = 10.0
"""Percentile over a clip of the lowest joint's height that counts as the floor; a minimum would follow the noise."""

_FLAT = 0.3
"""Sine of the angle between foot and shin below which the foot's heading is undetermined at rest."""


@dataclass(frozen=True, eq=False)
class Retargeted:
    """Result of retargeting a recording.

    Attributes:
        poses: The rig's poses, one per frame.
        used: Joints of the recording that drive a joint of the rig, or are ancestors of one that does.
        notes: Which joint drives which, and assumptions.
        warnings: Doubts about the recording's joints.
    """

    poses: Poses
    used: frozenset[int]
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def correspondence(clip: Clip, skeleton: Skeleton) -> dict[str, str]:
    """Joint names of a rig → names of the joints of a recording that drive them, except for the trunk."""
    return {skeleton.names[own]: clip.names[joint] for own, joint in pair_joints(clip, skeleton)[3].values()}


def retarget(clip: Clip, skeleton: Skeleton) -> Poses:
    """Poses of a rig that follow a recording; see the module's docstring for the formula.

    The root starts above its rest position and moves as the recording's does, scaled by the length of the legs (or of
    all bones that both have). Heights are such that the feet come down to their rest height.

    Raises:
        InputError: Nothing of the recording was recognised in the rig.
    """
    return retarget_and_tell(clip, skeleton).poses


def retarget_and_tell(clip: Clip, skeleton: Skeleton) -> Retargeted:
    """Retarget as ``retarget`` does, with the joints used, notes and warnings."""
    clip, source, target, pairs, notes = pair_joints(clip, skeleton)
    if not pairs and (source.pelvis is None or target.pelvis is None):
        raise InputError(
            f"no joint of the motion ({_some(clip.names)}) was recognised as one of the rig ({_some(skeleton.names)})"
        )
    axes = _axes(source, target)
    follow = _Follow(clip, skeleton, source, target, pairs, axes)
    scale, guessed = _scale(source, target, pairs)
    travel = _travel(follow, scale)

    def poses(frames: slice) -> Poses:
        some, there = follow.poses(clip[frames].plain()), travel[frames]
        return Poses(some.positions + there[:, None], some.rotations, some.flexion)

    used = {bone for _, bone in pairs.values()} | {source.last_part(name) for name in pairs if name in source.joints}
    used |= _trunk_followed(source, target) if follow.has_trunk else set()
    return Retargeted(
        streamed_rows(len(clip), poses),
        frozenset(j for bone in used for j in source.path(-1, bone)),
        (*notes, *_told(clip, skeleton, pairs, target, trunk=follow.has_trunk), *guessed),
        source.doubts,
    )


@dataclass(frozen=True, eq=False)
class _Follow:
    """Mapping from the frames of a recording to poses of a rig.

    Attributes:
        clip: The recording.
        skeleton: The rig's skeleton.
        source: Landmarks of the recording; ``target`` of the rig.
        pairs: Canonical name → (joint of the rig, joint of the recording).
        axes: W of the module's docstring, a quaternion.
    """

    clip: Clip
    skeleton: Skeleton
    source: Landmarks
    target: Landmarks
    pairs: dict[str, tuple[int, int]]
    axes: NDArray[np.float64]

    @cached_property
    def has_trunk(self) -> bool:
        """Whether both skeletons have a trunk."""
        return bool(self._trunk(self.clip[:1]))

    @cached_property
    def align(self) -> NDArray[np.float64]:
        """A of the module's docstring, shape (J, 4)."""
        align, trunk = np.empty((len(self.skeleton), 4)), self._trunk(self.clip[:1])
        driven = {j: name for name, (j, _) in self.pairs.items()}
        for j, parent in enumerate(self.skeleton.parents.tolist()):
            align[j] = _IDENTITY if parent < 0 or j in trunk else align[parent]
            if j in driven and j not in trunk:
                align[j] = _alignment(driven[j], self.source, self.target, self.axes, align[j])
        return align

    def _trunk(self, clip: Clip) -> dict[int, NDArray[np.float64]]:
        recorded = multiply(multiply(self.axes, clip.rotations), conjugate(self.axes))
        return _trunk(self.source, self.target, recorded)

    def poses(self, clip: Clip) -> Poses:
        """Poses at a block of frames, with the rig's root at rest."""
        skeleton, axes, trunk = self.skeleton, self.axes, self._trunk(clip)
        world = np.empty((len(clip), len(skeleton), 4))
        driven = {j: (name, b) for name, (j, b) in self.pairs.items()}
        for j, parent in enumerate(skeleton.parents.tolist()):
            if j in trunk:
                world[:, j] = trunk[j]
            elif j in driven:
                turned = multiply(multiply(axes, _turned(clip, self.source, *driven[j])), conjugate(axes))
                world[:, j] = multiply(turned, self.align[j])
            else:
                world[:, j] = _IDENTITY if parent < 0 else world[:, parent]
        above = -1 if trunk else int(skeleton.parents[min(j for j, _ in self.pairs.values())])
        while above >= 0:  # the forearm above a hand moves with it
            world[:, above] = world[:, min(driven)]
            above = int(skeleton.parents[above])
        local = world.copy()
        for j, parent in enumerate(skeleton.parents.tolist()):
            if parent >= 0:
                local[:, j] = multiply(conjugate(world[:, parent]), world[:, j])
        return poses_from_rotations(skeleton, local)


def _told(
    clip: Clip,
    skeleton: Skeleton,
    pairs: dict[str, tuple[int, int]],
    target: Landmarks,
    *,
    trunk: bool,
) -> list[str]:
    """Notes on which joint drives which, and on limbs and digits of the rig without a counterpart."""
    besides = "besides the trunk " if trunk else ""
    driven = ", ".join(f"{skeleton.names[own]} ← {clip.names[bone]}" for own, bone in pairs.values())
    notes = [f"{besides}these joints follow the recording: {driven}"] if driven else []
    idle = [name for name in limb_names() if name in target.joints and name not in pairs]
    if idle:
        notes.append(f"not in the recording, these follow the joint above them: {', '.join(idle)}")
    return notes


def _turned(clip: Clip, source: Landmarks, name: str, bone: int) -> NDArray[np.float64]:
    """R of one segment: its rotation from rest in the recording's axes, shape (F, 4); see the module's docstring."""
    end = source.following(name) if name in source.joints else None
    if end is None:
        return clip.rotations[:, bone]
    # upper arms and thighs turn as a whole; elbows and knees do not twist: later parts twist along the segment
    part = source.last_part(name) if name.endswith((".shoulder", ".hip")) else bone
    given = rotate(clip.rotations[:, part], clip.rest[end] - clip.rest[bone])
    wanted = clip.positions[:, end] - clip.positions[:, bone]
    known = (np.linalg.norm(given, axis=1) > 0.0) & (np.linalg.norm(wanted, axis=1) > 0.0)
    out = clip.rotations[:, part].copy()
    out[known] = multiply(minimal_rotation(given[known], wanted[known]), out[known])
    return out


def _axes(source: Landmarks, target: Landmarks) -> NDArray[np.float64]:
    """W: of the 24 rotations between coordinate axes, the one that best aligns the two rest bodies."""
    frames = [_body_frame(marks) for marks in (source, target)]
    if frames[0] is None or frames[1] is None:
        return _IDENTITY
    turn = frames[1] @ frames[0].T
    group = axis_turns()
    return np.asarray(group[np.argmax(np.einsum("gij,ij->g", matrices(group), turn))])


def _body_frame(marks: Landmarks) -> NDArray[np.float64] | None:
    """Columns left, up, forward; up along the trunk, since thighs may be bent at rest, or else against the thighs."""
    thighs, trunk = marks.segment("hip", "knee", marks.rest), marks.trunk(marks.rest)
    across = next((a for part in ("hip", "shoulder") if (a := marks.across(part, marks.rest)) is not None), None)
    along = trunk if thighs is None or (trunk is not None and trunk.any()) else -thighs.sum(axis=0)
    if across is None or along is None:
        return None
    up = unit(along)
    left = unit(np.cross(up, np.cross(across, up)))
    return np.column_stack([left, up, np.cross(left, up)])


def _trunk(source: Landmarks, target: Landmarks, recorded: NDArray[np.float64]) -> dict[int, NDArray[np.float64]]:
    """Rotations of the rig's trunk joints by index, interpolated from pelvis to chest and from chest to head."""
    ends = [(marks.pelvis, marks.chest, marks.joints.get("head")) for marks in (source, target)]
    out: dict[int, NDArray[np.float64]] = {}
    if ends[0][0] is not None and ends[1][0] is not None:
        out[ends[1][0]] = recorded[:, ends[0][0]]
    for (a, b), (c, d) in zip(
        zip(ends[0], ends[0][1:], strict=False), zip(ends[1], ends[1][1:], strict=False), strict=True
    ):
        if a is None or b is None or c is None or d is None:
            continue
        given = recorded[:, [a, *source.path(a, b)]]
        chain = target.path(c, d)
        fractions = np.arange(1, len(chain) + 1) / max(len(chain), 1)
        spread = slerp(np.linspace(0.0, 1.0, given.shape[1]), given.swapaxes(0, 1), fractions)
        out |= dict(zip(chain, spread, strict=True))
    return out


def _trunk_followed(source: Landmarks, target: Landmarks) -> set[int]:
    """Pelvis, chest and head of the recording, as far as the rig has them, too."""
    ends = [(marks.pelvis, marks.chest, marks.joints.get("head")) for marks in (source, target)]
    return {a for a, b in zip(*ends, strict=True) if a is not None and b is not None}


def _alignment(
    name: str, source: Landmarks, target: Landmarks, axes: NDArray[np.float64], inherited: NDArray[np.float64]
) -> NDArray[np.float64]:
    """A of one joint, given its parent's; see the module's docstring."""
    side, _, part = name.partition(".")
    if part == "clavicle":
        return _IDENTITY
    if name not in source.joints:
        return inherited
    wanted, own = source.bone(name), target.bone(name)
    if wanted is None or own is None:
        return inherited
    wanted, moved = rotate(axes, wanted), rotate(inherited, own)
    if part == "ankle":
        shin = target.bone(f"{side}.knee") if f"{side}.knee" in target.joints else None
        up = np.array([0.0, 1.0, 0.0]) if shin is None else rotate(inherited, -shin)
        if np.linalg.norm(np.cross(unit(up), unit(wanted))) < _FLAT:
            return inherited
        return multiply(_turn_about(up, moved, wanted), inherited)
    aligned = multiply(minimal_rotation(moved, wanted), inherited)
    thumbs = source.thumb_side(side), target.thumb_side(side)
    if part == "wrist" and thumbs[0] is not None and thumbs[1] is not None:
        return multiply(_turn_about(wanted, rotate(aligned, thumbs[1]), rotate(axes, thumbs[0])), aligned)
    return aligned


def _turn_about(axis: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation about an axis that brings ``start`` as close as possible to ``end``."""
    a = unit(axis)
    u, v = start - a * (a @ start), end - a * (a @ end)
    angle = np.arctan2(a @ np.cross(u, v), u @ v)
    return np.array([*(np.sin(angle / 2.0) * a), np.cos(angle / 2.0)])


def _travel(follow: _Follow, scale: float) -> NDArray[np.float64]:
    """Displacement [m] to add to all joints, shape (F, 3)."""
    source, target, pairs = follow.source, follow.target, follow.pairs
    if source.pelvis is not None and target.pelvis is not None:
        joint, bone = target.pelvis, source.pelvis
    else:
        joint, bone = min(pairs.values())
    tips = {j for name, j in target.joints.items() if ".toe" in name and not name.endswith(".base")}
    # all joints, as in kneeling or handstands, but toe tips: rigid toes would reach below the floor
    down = [j for j in range(len(target.rest)) if j not in tips]
    start = follow.clip[:1].positions[0, bone]

    def found(clip: Clip) -> NDArray[np.float64]:
        """Displacement, and height of the lowest joint after it [m], shape (f, 4)."""
        poses = follow.poses(clip)
        moved = scale * rotate(follow.axes, clip.positions[:, bone] - start)
        travel = target.rest[joint] - poses.positions[:, joint] + moved
        return np.column_stack([travel, (poses.positions[:, down, 1] + travel[:, 1:2]).min(axis=1)])

    rows = follow.clip.each(found)
    travel = rows[:, :3].copy()
    if any(name.endswith(".ankle") for name in pairs):
        travel[:, 1] += target.rest[down, 1].min() - np.percentile(rows[:, 3], _GROUND_PERCENTILE)
    return travel


def _scale(source: Landmarks, target: Landmarks, pairs: dict[str, tuple[int, int]]) -> tuple[float, tuple[str, ...]]:
    """Ratio of the rig's size to the recording's, by the legs or else all common bones, and a note on the latter."""
    legs = [name for name in pairs if name.endswith((".hip", ".knee"))]
    lengths = []
    for marks in (source, target):
        bones = [marks.bone(name) if name in marks.joints else None for name in legs or pairs]
        lengths.append([0.0 if bone is None else float(np.linalg.norm(bone)) for bone in bones])
    known = [(a, b) for a, b in zip(*lengths, strict=True) if a > 0.0 and b > 0.0]
    scale = sum(b for _, b in known) / sum(a for a, _ in known) if known else 1.0
    if legs and known:
        return scale, ()
    basis = "from the other bones in common" if known else "as 1, since they have no bone in common"
    return scale, (f"the recording and the rig have no legs in common: the scale of its travel is estimated {basis}",)


def _some(names: tuple[str, ...]) -> str:
    return ", ".join(names[:4]) + (", …" if len(names) > 4 else "")
