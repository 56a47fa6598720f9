"""Poses to calibrate and judge a covering by: every joint alone, curls and fists, and random ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import Poses, poses_from_angles
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["CURL", "calibration_poses", "curled"]

CURL = {"base": 80.0, "knuckle2": 97.0, "knuckle3": 63.0}
"""Flexion [degrees] of a finger's joints in a full curl; the thumb takes no part."""

_FLEXION, _ABDUCTION = CHANNELS.index("flexion"), CHANNELS.index("abduction")
_WIDEST = np.radians(100.0)  # shoulders, hips, knees and elbows in full are poses of their own kind
_UNKNOWN = np.radians(30.0)  # where limits are as wide one way as the other: nothing is known of the joint
_CURLS = (0.3, 0.6, 0.9)


def curled(skeleton: Skeleton, amounts: NDArray[np.float64] | list[float] | tuple[float, ...]) -> Poses:
    """Index to pinky of every hand curled by fractions of ``CURL``, one a frame."""
    return poses_from_angles(skeleton, _curls(skeleton, amounts))


def calibration_poses(skeleton: Skeleton, count: int | None = None, *, seed: int = 0) -> Poses:
    """Poses over the joint ranges of a skeleton, in the order in which they matter.

    Curls of 0.3, 0.6 and 0.9 first, then fists (every joint of index to pinky at 0.5 and 0.8 of its flexion) and the
    thumb opposed and spread, random poses within the limits, and every joint alone at its full and half flexion.

    Args:
        skeleton: The rest skeleton.
        count: How many to take: the first of each kind in turn; by default all.
        seed: Of the random poses.

    Raises:
        InputError: A skeleton whose joints cannot flex, or a count below 1.
    """
    if count is not None and count < 1:
        raise InputError(f"count: want at least 1 pose, got {count}")
    low, high = np.moveaxis(skeleton.limits[:, _FLEXION], -1, 0)
    largest = np.minimum(high, np.where(low <= -high, _UNKNOWN, _WIDEST))
    inner = (skeleton.parents >= 0) & np.array([bool(c) for c in skeleton.children])
    bends = np.flatnonzero(inner & (largest > 1e-6))
    if not bends.size:
        raise InputError("skeleton: none of its joints may flex; its limits are closed")
    kinds = [
        _curls(skeleton, _CURLS),
        _fists(skeleton, bends, largest),
        _random(skeleton, bends, largest, seed),
        _alone(skeleton, bends, largest, 1.0),
        _alone(skeleton, bends, largest, 0.5),
    ]
    angles = np.concatenate([k for k in kinds if len(k)])
    if count is not None and count < len(angles):
        turn = np.concatenate([np.arange(len(k)) + 0.1 * i for i, k in enumerate(kinds) if len(k)])
        angles = angles[np.sort(np.argsort(turn, kind="stable")[:count])]
    return poses_from_angles(skeleton, angles)


def _curls(skeleton: Skeleton, amounts: NDArray[np.float64] | list[float] | tuple[float, ...]) -> NDArray[np.float64]:
    joints = [
        (j, CURL[name.rpartition(".")[2]])
        for j, name in enumerate(skeleton.names)
        if _digit(name) in DIGITS[:-1] and name.rpartition(".")[2] in CURL
    ]
    if not joints:
        return np.zeros((0, len(skeleton), len(CHANNELS)))
    angles = np.zeros((len(amounts), len(skeleton), len(CHANNELS)))
    for j, full in joints:
        angles[:, j, _FLEXION] = np.asarray(amounts) * np.radians(full)
    return angles


def _fists(skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Metacarpals and fingers half and nearly closed; then thumbs opposed and spread, by themselves: their large roots
    lose what no parameter gives back, and fingers must not make up for them."""
    fingers = [j for j in bends if _digit(skeleton.names[j]) in DIGITS[:-1]]
    roots = [j for j in bends if skeleton.names[j].endswith("thumb.base")]
    angles = np.zeros((4, len(skeleton), len(CHANNELS)))
    for frame, amount in enumerate((0.5, 0.8)):
        angles[frame, fingers, _FLEXION] = amount * largest[fingers]
    for frame, end in ((2, 0), (3, 1)):
        angles[frame, roots, _ABDUCTION] = 0.5 * skeleton.limits[roots, _ABDUCTION, end]
    angles[2, roots, _FLEXION] = largest[roots]
    return angles[[bool(fingers)] * 2 + [bool(roots)] * 2]


def _random(
    skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64], seed: int, frames: int = 8
) -> NDArray[np.float64]:
    """Flexion anywhere up to the limit, abduction in the inner half of its range."""
    generator = np.random.default_rng(seed)
    angles = np.zeros((frames, len(skeleton), len(CHANNELS)))
    angles[:, bends, _FLEXION] = generator.uniform(0.0, 1.0, (frames, len(bends))) * largest[bends]
    low, high = (np.clip(skeleton.limits[bends, _ABDUCTION, k], -_WIDEST / 4, _WIDEST / 4) for k in (0, 1))
    angles[:, bends, _ABDUCTION] = generator.uniform(0.5 * low, 0.5 * high, (frames, len(bends)))
    return angles


def _alone(
    skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64], part: float
) -> NDArray[np.float64]:
    angles = np.zeros((len(bends), len(skeleton), len(CHANNELS)))
    angles[np.arange(len(bends)), bends, _FLEXION] = part * largest[bends]
    return angles


def _digit(name: str) -> str:
    parts = name.split(".")
    return parts[-2] if len(parts) > 1 and parts[-2] in DIGITS else ""
