"""Bend angles of a recording's fingers, and the side and plausibility of the hand that follow from them.

A finger bends to the palm and hardly to the back of the hand. Taken as the other hand, the same joint positions give
bends of opposite sign: the recorded hand is the one whose fingers stay within their limits.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import minimal_rotation, rotate, unit
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.limits import default_limits

__all__ = ["BENDING", "FINGERS", "bending_side", "bent_beyond_limits", "finger_bends", "leaning"]

FINGERS = ("index", "middle", "ring", "pinky")
BENDING = ("base", "knuckle2", "knuckle3")

_LEAST = default_limits([f"index.{joint}" for joint in BENDING])[:, 0, 0]
"""Smallest flexions [rad] of a finger's joints: the base extends by up to 45°, the others not beyond straight."""
_TOLERANCE = np.radians(15.0)
"""Allowance for tracking errors and joint laxity: smaller violations of a limit are ignored."""
_TELLING = np.radians(20.0)
"""Smallest difference of violations, summed over joints and frames, that decides a hand's side."""
_STRAIGHT = np.radians(20.0)
"""Mean bend that weighs as much for a hand's side as a thumb one palm's width in front of the palm."""
_HEEL = {"wrist", "thumb.base", *(f"{finger}.carpometacarpal" for finger in FINGERS)}
"""Joints at the proximal end of the palm, which replace a missing wrist."""
_LEANS = 0.15
"""Smallest absolute score at which thumb and slight bends decide the side of a flat hand."""


def finger_bends(points: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Bends [rad] of base, knuckle2 and knuckle3 of index to pinky, shape (K, 4, 3), for a right hand.

    Positive is towards the palm of a right hand; the bends of a left hand are the negatives. The first bone of a finger
    is compared with its metacarpal (or the line from the wrist), each other bone with the one before; the axis starts
    across the palm and is transported along the bones by minimal rotations. Missing joints have bends of 0.

    Args:
        points: Joint name without side, such as ``index.base`` → its positions, shape (K, 3).
    """
    if not _spanned(points):
        return np.zeros((len(next(iter(points.values()))), len(FINGERS), len(BENDING)))
    heel, radial, _ = _palm(points)
    bends = np.zeros((len(radial), len(FINGERS), len(BENDING)))
    for f, finger in enumerate(FINGERS):
        chain = [points[name] for joint in FINGER_JOINTS if (name := f"{finger}.{joint}") in points]
        if len(chain) < len(FINGER_JOINTS):
            continue
        before = unit(chain[0] - points.get(f"{finger}.carpometacarpal", heel))
        before = np.where(np.any(before != 0.0, axis=-1, keepdims=True), before, np.array([1.0, 0.0, 0.0]))
        axis = unit(radial - before * (before * radial).sum(axis=-1, keepdims=True))
        for k, (joint, following) in enumerate(pairwise(chain)):
            bone = unit(following - joint)
            bone = np.where(np.any(bone != 0.0, axis=-1, keepdims=True), bone, before)
            flat = bone - axis * (axis * bone).sum(axis=-1, keepdims=True)
            sine = (np.cross(before, flat) * axis).sum(axis=-1)
            bends[:, f, k] = np.arctan2(sine, (before * flat).sum(axis=-1))
            axis = rotate(minimal_rotation(before, bone), axis)
            before = bone
    return bends


def bent_beyond_limits(bends: NDArray[np.float64], side: str) -> NDArray[np.float64]:
    """Excess [rad] of extension over limit and tolerance for a ``left`` or ``right`` hand, at least 0."""
    flexion = bends if side == "right" else -bends
    return np.asarray(np.maximum(_LEAST - _TOLERANCE - flexion, 0.0))


def bending_side(bends: NDArray[np.float64]) -> str | None:
    """The hand whose flexions are plausible over all frames; None where both are, or neither.

    At least two joints of the other hand must exceed their limits: a single one may be a tracking error.
    """
    left, right = bent_beyond_limits(bends, "left"), bent_beyond_limits(bends, "right")
    worse = left if left.sum() > right.sum() else right
    if abs(left.sum() - right.sum()) < _TELLING or np.count_nonzero(worse.any(axis=0)) < 2:
        return None
    return "right" if worse is left else "left"


def leaning(points: Mapping[str, NDArray[np.float64]], bends: NDArray[np.float64]) -> str | None:
    """The probable side of a nearly flat hand: fingers rest slightly bent, and the thumb lies in front of the palm.

    None where neither is visible, as in a hand laid on a table, which is its own mirror image.
    """
    if not _spanned(points):
        return None
    heel, _, normal = _palm(points)
    width = np.linalg.norm(points["index.base"] - points["pinky.base"], axis=-1)
    heights = [
        -((points[name] - heel) * normal).sum(axis=-1) / np.where(width > 0.0, width, 1.0)
        for joint in ("knuckle2", "knuckle3", "tip")
        if (name := f"thumb.{joint}") in points
    ]
    score = float(np.mean(heights)) if heights else 0.0
    score += float(bends[..., 1:].mean() / _STRAIGHT)
    return None if abs(score) < _LEANS else ("right" if score > 0.0 else "left")


def _spanned(points: Mapping[str, NDArray[np.float64]]) -> bool:
    return {"index.base", "pinky.base"} <= points.keys() and bool(_HEEL & points.keys())


def _palm(
    points: Mapping[str, NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Per frame: the palm's proximal end, the direction to the thumb's side, and the normal (dorsal for a right
    hand)."""
    heel = points.get("wrist", np.mean([points[name] for name in sorted(_HEEL & points.keys())], axis=0))
    bases = np.mean([points[name] for finger in FINGERS if (name := f"{finger}.base") in points], axis=0)
    forward = unit(bases - heel)
    across = points["index.base"] - points["pinky.base"]
    radial = unit(across - forward * (forward * across).sum(axis=-1, keepdims=True))
    return heel, radial, np.cross(forward, radial)
