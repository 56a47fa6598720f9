"""Anatomical names of body segments: ``left.forearm``, ``right.thigh``, ``trunk`` (B §2.1)."""

from __future__ import annotations

from warpjld.errors import InputError
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.tree import Skeleton
from warpjld.suggest import did_you_mean

__all__ = ["SEGMENT_JOINTS", "segment_joints"]

SEGMENT_JOINTS: dict[str, tuple[str, ...]] = {
    "upper_arm": ("shoulder",),
    "forearm": ("forearm", "elbow", "forearm_twist"),
    "hand": ("wrist", "carpometacarpal", "base", "knuckle2", "knuckle3"),
    "thigh": ("hip",),
    "shin": ("knee",),
    "foot": ("ankle", "ball"),
    "trunk": ("pelvis", "spine", "sternum", "clavicle", "pelvic_hip"),
    "neck": ("neck",),
    "head": ("head",),
}
"""Names of the joints at which the bones of each segment begin, without side and number."""


def segment_joints(skeleton: Skeleton, name: str) -> list[int]:
    """Indices of the joints at which the bones of a named segment begin.

    Args:
        skeleton: The skeleton.
        name: Anatomical name, with a side, or without for both sides; or the name of a joint, for the segment that
            begins there. Case is ignored.

    Raises:
        InputError: The skeleton has no such segment; suggests a similar name.
    """
    wanted = name.lower()
    side, _, word = wanted.rpartition(".")
    if word in SEGMENT_JOINTS and side in ("", "left", "right"):
        found = [
            joint
            for joint, known in enumerate(skeleton.names)
            if skeleton.children[joint] and _segment_of(known) == word and known.startswith(f"{side}." if side else "")
        ]
    else:
        found = [joint for joint, known in enumerate(skeleton.names) if skeleton.children[joint] and known == wanted]
    if not found:
        sides = [f"{prefix}.{word}" for prefix in ("left", "right") for word in SEGMENT_JOINTS]
        more = did_you_mean(wanted, (*sides, *SEGMENT_JOINTS, *skeleton.names))
        raise InputError(f"there is no segment '{name}' in this skeleton{more}")
    return found


def _segment_of(joint: str) -> str:
    """Anatomical name of the segment that begins at a joint; empty if :data:`SEGMENT_JOINTS` has none."""
    words = joint.split(".")
    last = words[-1].rstrip("0123456789") if words[-1] not in ("knuckle2", "knuckle3") else words[-1]
    if any(word in DIGITS for word in words):
        return "hand"
    return next((segment for segment, joints in SEGMENT_JOINTS.items() if last in joints), "")
