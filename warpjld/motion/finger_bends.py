"""How far the fingers of a recording bend at each knuckle, and what that says: which hand it is, and whether it can be.

A finger bends to the palm and hardly to the back of the hand. Seen as the other hand, the same joint positions bend by
the same angles of the opposite sign: the hand on which no finger bends beyond its limits is the one recorded.
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
"""Smallest flexions [rad] of a finger's joints: its base goes back by 45°, the others are straight at most."""
_TOLERANCE = np.radians(15.0)
"""Trackers err by so much, and people's joints give: bends back beyond a limit by less say nothing."""
_TELLING = np.radians(20.0)
"""Bends beyond the limits, over all joints and frames, from which they tell one hand from the other."""
_STRAIGHT = np.radians(20.0)
"""Mean bend that tells as much of a hand's side as a thumb one palm's width before the palm."""
_HEEL = {"wrist", "thumb.base", *(f"{finger}.carpometacarpal" for finger in FINGERS)}
"""Joints at the near end of the palm: where a recording has no wrist, the others stand for it."""
_LEANS = 0.15
"""Score from which thumb and slight bends tell the side of a flat hand."""


def finger_bends(points: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Bends [rad] of base, second and third knuckle of index to pinky, shape (K, 4, 3), as of a right hand.

    Positive is to the palm of a right hand, so that a left hand's bends are the negative of these. The first bone of a
    finger is compared to its metacarpal (or to the line from the wrist), the others to the bone before; the axis starts
    across the palm and turns with the bones by minimal rotations. Joints that a recording lacks do not bend.

    Args:
        points: Joint without its side, such as ``index.base`` → its positions, shape (K, 3).
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
    """How far [rad] joints of a ``left`` or ``right`` hand bend back beyond limit and tolerance, 0 or more."""
    flexion = bends if side == "right" else -bends
    return np.asarray(np.maximum(_LEAST - _TOLERANCE - flexion, 0.0))


def bending_side(bends: NDArray[np.float64]) -> str | None:
    """The hand whose flexions are the possible ones over all frames; None where both are, or neither.

    As the other one, at least two joints must bend beyond their limits: a single one may be a tracker's slip.
    """
    left, right = bent_beyond_limits(bends, "left"), bent_beyond_limits(bends, "right")
    worse = left if left.sum() > right.sum() else right
    if abs(left.sum() - right.sum()) < _TELLING or np.count_nonzero(worse.any(axis=0)) < 2:
        return None
    return "right" if worse is left else "left"


def leaning(points: Mapping[str, NDArray[np.float64]], bends: NDArray[np.float64]) -> str | None:
    """The hand that an all but flat one looks like: fingers rest slightly bent, and the thumb lies before the palm.

    None where neither is to be seen, as in a hand laid on a table: it is its own mirror image.
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
    """Of every frame: where the hand begins, its direction to the thumb's side, and the normal: a right hand's back."""
    heel = points.get("wrist", np.mean([points[name] for name in sorted(_HEEL & points.keys())], axis=0))
    bases = np.mean([points[name] for finger in FINGERS if (name := f"{finger}.base") in points], axis=0)
    forward = unit(bases - heel)
    across = points["index.base"] - points["pinky.base"]
    radial = unit(across - forward * (forward * across).sum(axis=-1, keepdims=True))
    return heel, radial, np.cross(forward, radial)
