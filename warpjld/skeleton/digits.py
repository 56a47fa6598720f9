"""The digits of a skeleton and their flexion joints."""

from __future__ import annotations

from warpjld.skeleton.hand import DIGITS, FINGER_JOINTS
from warpjld.skeleton.tree import Skeleton

__all__ = ["digit_joints", "is_digit"]


def digit_joints(skeleton: Skeleton) -> dict[str, tuple[int, ...]]:
    """Flexion joints of every digit, base first, by the digit's name (``index``, ``left.index``).

    Ordered by side, then from pinky to thumb. Digits with fewer than three phalanges have fewer joints.
    """
    found = {}
    for side in ("left.", "right.", ""):
        for digit in DIGITS:
            names = [f"{side}{digit}.{joint}" for joint in FINGER_JOINTS[:-1]]
            if joints := tuple(skeleton.names.index(name) for name in names if name in skeleton.names):
                found[f"{side}{digit}"] = joints
    return found


def is_digit(name: str) -> bool:
    """Whether a joint of this canonical name belongs to a finger, a thumb or a toe."""
    digit = name.removeprefix("left.").removeprefix("right.").partition(".")[0]
    return digit in DIGITS or digit.startswith("toe")
