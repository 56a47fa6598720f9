"""Correspondence of a recording's joints to a rig's, except for the trunk."""

from __future__ import annotations

from warpjld.motion.clip import Clip
from warpjld.motion.landmarks import Landmarks, landmarks_of_skeleton
from warpjld.motion.rest_pose import with_usable_rest
from warpjld.skeleton import DIGITS, Skeleton

__all__ = ["limb_names", "pair_joints"]

_LIMBS = ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "ball")
_DIGIT_JOINTS = ("base", "knuckle2", "knuckle3")


def limb_names() -> list[str]:
    """Canonical names of the joints of limbs and digits, parents first."""
    return [
        f"{side}.{part}"
        for side in ("left", "right")
        for part in (*_LIMBS, *(f"{digit}.{joint}" for digit in DIGITS for joint in _DIGIT_JOINTS))
    ]


def pair_joints(
    clip: Clip, skeleton: Skeleton
) -> tuple[Clip, Landmarks, Landmarks, dict[str, tuple[int, int]], tuple[str, ...]]:
    """The clip with a usable rest pose, landmarks of both, canonical name → (joint of the rig, joint of the clip), and
    notes."""
    sides = {name.partition(".")[0] for name in skeleton.names if name.endswith(".wrist")}
    clip, source, notes = with_usable_rest(clip, side=sides.pop() if len(sides) == 1 else None)
    target = landmarks_of_skeleton(skeleton)
    both = source.joints.keys() & target.joints.keys()
    # a single bone for all fingers (mitten) would move this finger without its neighbours
    mittens = {
        f"{side}.{digit}"
        for side in ("left", "right")
        for digit in DIGITS
        if not {f"{side}.{digit}.base", f"{side}.{digit}.knuckle2"} <= both
    }
    names = [n for n in limb_names() if n in both and n.rpartition(".")[0] not in mittens]
    pairs = {n: (target.joints[n], source.joints[n]) for n in names}
    return clip, source, target, pairs | _toes(source, target), notes


def _toes(source: Landmarks, target: Landmarks) -> dict[str, tuple[int, int]]:
    """Toes by number; where only the rig has five toes, or only the clip, the ball and the toes are paired."""
    out = {}
    for side in ("left", "right"):
        toes = [name for name in target.joints if name.startswith(f"{side}.toe") and not name.endswith(".tip")]
        ball = source.joints.get(f"{side}.ball")
        for name in toes:
            if name in source.joints:
                out[name] = target.joints[name], source.joints[name]
            elif name.endswith(".base") and ball is not None and f"{side}.ball" not in target.joints:
                out[name] = target.joints[name], ball
        middle = next((source.joints[k] for n in (3, 2, 1) if (k := f"{side}.toe{n}.base") in source.joints), None)
        if f"{side}.ball" in target.joints and ball is None and middle is not None:
            out[f"{side}.ball"] = target.joints[f"{side}.ball"], middle
    return out
