"""Landmarks for retargeting: canonical joints of a recording or a rig, and the bones between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.motion.clip import Clip
from warpjld.skeleton import DIGITS, Skeleton

__all__ = ["Landmarks", "landmarks_of_clip", "landmarks_of_skeleton"]

_NEXT = {"clavicle": "shoulder", "shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "ankle"} | {
    f"{digit}.{joint}": f"{digit}.{following}"
    for digit in DIGITS
    for joint, following in (("base", "knuckle2"), ("knuckle2", "knuckle3"), ("knuckle3", "tip"))
}
_TOWARDS_FINGERS = ("middle.base", "ring.base", "index.base", "pinky.base")
_LIMBS = (".clavicle", ".shoulder", ".elbow", ".wrist", ".hip", ".knee", ".ankle", ".ball")
_NO_LENGTH = 1e-6
"""Bone length that counts as zero, per size of the figure."""
_ONE_LINE = 0.02
"""Largest sine at which offsets count as parallel; a rest pose on one line does not give joint positions."""


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Canonical names → joints of a tree.

    Attributes:
        joints: Canonical name, such as ``left.elbow`` or ``right.index.base``, → joint index.
        parents: Parent of every joint, -1 for a root.
        rest: Joint positions at rest, shape (J, 3).
        notes: Decisions of recognition.
        doubts: Probable errors of recognition.
    """

    joints: dict[str, int]
    parents: NDArray[np.signedinteger]
    rest: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def pelvis(self) -> int | None:
        """Common ancestor of the legs; without legs the joint named pelvis."""
        met = self._meeting("left.hip", "right.hip")
        return met if met is not None or self._any("hip") else self.joints.get("pelvis")

    @property
    def chest(self) -> int | None:
        """Common ancestor of the arms; without arms the uppermost vertebra."""
        met = self._meeting("left.shoulder", "right.shoulder")
        if met is not None or self._any("shoulder"):
            return met
        spine = [j for name, j in self.joints.items() if name.rstrip("0123456789") == "spine"]
        return max(spine, key=lambda j: len(self.path(-1, j)), default=None)

    def path(self, start: int, end: int) -> tuple[int, ...]:
        """Joints below ``start`` down to ``end``; empty where ``end`` is not a descendant of it."""
        out: list[int] = []
        joint = end
        while joint >= 0 and joint != start:
            out.append(joint)
            joint = int(self.parents[joint])
        return tuple(reversed(out)) if joint == start else ()

    def following(self, name: str) -> int | None:
        """Joint at the far end of a joint's segment, along the limb or digit; None at its end."""
        side, _, part = name.partition(".")
        joint = self.joints.get(f"{side}.{_NEXT.get(part)}")
        return joint if joint is not None and self.path(self.joints[name], joint) else None

    def last_part(self, name: str) -> int:
        """Joint whose bone ends the segment: itself, or the last of the joints that subdivide the segment."""
        end = self.following(name)
        return self.joints[name] if end is None else int(self.parents[end])

    def bone(self, name: str) -> NDArray[np.float64] | None:
        """Rest vector from a joint to the next of its limb: from a wrist to the fingers, from an ankle to the toes."""
        joint = self.joints[name]
        side, _, part = name.partition(".")
        if part == "wrist":
            ends = [self.joints[key] for f in _TOWARDS_FINGERS if (key := f"{side}.{f}") in self.joints][:1]
        elif part == "ankle":
            ends = [self.joints[key] for key in (f"{side}.ball",) if key in self.joints]
            ends = ends or [j for n, j in self.joints.items() if n.startswith(f"{side}.toe") and n.endswith(".base")]
        else:
            ends = [self.joints[key] for key in (f"{side}.{_NEXT.get(part)}",) if key in self.joints]
        if not ends and part in ("wrist", "ankle"):
            ends = [j for j in range(len(self.rest)) if self.path(joint, j)]
        if not ends:
            return None
        vector = np.asarray(self.rest[ends].mean(axis=0) - self.rest[joint])
        return vector if np.linalg.norm(vector) > 0.0 else None

    def thumb_side(self, side: str) -> NDArray[np.float64] | None:
        """Rest vector from a wrist to its thumb."""
        for joint in ("thumb.knuckle2", "thumb.tip"):
            if f"{side}.{joint}" in self.joints and f"{side}.wrist" in self.joints:
                return np.asarray(self.rest[self.joints[f"{side}.{joint}"]] - self.rest[self.joints[f"{side}.wrist"]])
        return None

    def across(self, part: str, places: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Vector from a right joint such as the ``hip`` to the left one, for positions of shape (…, J, 3)."""
        ends = self.joints.get(f"left.{part}"), self.joints.get(f"right.{part}")
        return None if ends[0] is None or ends[1] is None else places[..., ends[0], :] - places[..., ends[1], :]

    def segment(self, part: str, end: str, places: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Unit vectors from a joint such as the ``hip`` to another, for both sides, shape (2, …, 3), or None."""
        names = [f"{side}.{joint}" for side in ("left", "right") for joint in (part, end)]
        if not self.joints.keys() >= set(names):
            return None
        a, b, c, d = (places[..., self.joints[name], :] for name in names)
        return unit(np.stack([b - a, d - c]))

    def trunk(self, places: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Vector from the pelvis to the chest, or the head where these coincide, for positions of shape (…, J, 3)."""
        start = self.pelvis
        end = next((j for j in (self.chest, self.joints.get("head")) if j is not None and j != start), None)
        return None if start is None or end is None else places[..., end, :] - places[..., start, :]

    def _any(self, part: str) -> bool:
        return f"left.{part}" in self.joints or f"right.{part}" in self.joints

    def _meeting(self, a: str, b: str) -> int | None:
        if a not in self.joints or b not in self.joints:
            return None
        above = set()
        joint = self.joints[a]
        while joint >= 0:
            above.add(joint)
            joint = int(self.parents[joint])
        joint = self.joints[b]
        while joint >= 0 and joint not in above:
            joint = int(self.parents[joint])
        return joint if joint >= 0 else None


def landmarks_of_skeleton(skeleton: Skeleton) -> Landmarks:
    """Landmarks of a rig's skeleton, whose names are canonical. The root of a forearm without elbow stands for it."""
    joints = {name: j for j, name in enumerate(skeleton.names)}
    for side in ("left", "right"):
        if f"{side}.forearm" in joints:
            joints.setdefault(f"{side}.elbow", joints[f"{side}.forearm"])
    return Landmarks(joints, skeleton.parents, skeleton.rest)


def landmarks_of_clip(clip: Clip, *, side: str | None = None) -> Landmarks:
    """Landmarks of a recording, recognised like a rig's joints: by names in any common convention, or by shape.

    Args:
        clip: The recording.
        side: Side of a hand whose joint names do not state it.
    """
    from warpjld.skeleton.recognise.by_name import roles_by_name
    from warpjld.skeleton.recognise.recognise import recognise
    from warpjld.skeleton.recognise.tree import SourceTree

    places = _most_stretched(clip) if _says_nothing(clip) else clip.rest
    kept = _with_bones(clip, places)
    number = {j: k for k, j in enumerate(kept)} | {-1: -1}
    frames = np.tile(np.eye(4), (len(kept), 1, 1))
    frames[:, :3, 3] = places[kept]
    parents = np.array([number[int(clip.parents[j])] for j in kept], dtype=np.int64)
    tree = SourceTree(tuple(clip.names[j] for j in kept), parents, frames)
    roles = recognise(tree)
    joints = dict(roles.body)
    for hand in roles.hands:
        joints |= {f"{hand.side or side}.{name}": joint for name, joint in hand.joints.items()}
    for name, joint in roles_by_name(tree).body.items():
        # a wrist without a complete hand is kept: recordings often have only some finger joints
        if name.endswith(_LIMBS) and name not in joints and joint not in joints.values():
            joints[name] = joint
    by_shape = ("the recording's joints are recognised by shape, not by name",) if roles.how == "shape" else ()
    joints = {name: kept[joint] for name, joint in joints.items()}
    # the remedy that recognition suggests, a joint map, applies to rigs only
    doubts = tuple(f"in the recording, {doubt.partition('; if ')[0]}" for doubt in roles.suspicious)
    return Landmarks(joints, clip.parents, clip.rest, (*by_shape, *roles.notes), doubts)


def _with_bones(clip: Clip, places: NDArray[np.float64]) -> list[int]:
    """Joints without leaves at zero bone length: End Sites with a zero offset would be taken for tips."""
    above = np.maximum(clip.parents, 0)
    short = np.linalg.norm(places - places[above], axis=1) <= _NO_LENGTH * np.linalg.norm(np.ptp(places, axis=0))
    ends = ~np.isin(np.arange(len(places)), clip.parents) & (clip.parents >= 0)
    return [int(j) for j in np.flatnonzero(~(short & ends))]


def _says_nothing(clip: Clip) -> bool:
    """Whether the rest's bones have no length, or more than three quarters of them are parallel."""
    inner = clip.parents >= 0
    bones = clip.rest[inner] - clip.rest[clip.parents[inner]]
    lengths = np.linalg.norm(bones, axis=1)
    if not inner.any() or not lengths.max() > 0.0:
        return bool(inner.any())
    longest = bones[lengths.argmax()] / lengths.max()
    along = np.linalg.norm(np.cross(longest, unit(bones)), axis=1) < _ONE_LINE
    return bool(along.mean() > 0.75)


def _most_stretched(clip: Clip) -> NDArray[np.float64]:
    """Joint positions in the first frame with (nearly) the largest sum of leaf-to-root distances, shape (B, 3)."""
    roots = np.arange(len(clip.names))
    for j, parent in enumerate(clip.parents):
        roots[j] = j if parent < 0 else roots[parent]
    ends = np.setdiff1d(np.arange(len(clip.names)), clip.parents)
    reach = clip.each(
        lambda some: np.linalg.norm(some.positions[:, ends] - some.positions[:, roots[ends]], axis=-1).sum(axis=1)
    )
    frame = int(np.argmax(reach >= 0.98 * reach.max()))
    return np.asarray(clip[frame : frame + 1].positions[0])
