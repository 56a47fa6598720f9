"""Sets of poses for calibrating and assessing a covering: single joints, curls, fists, and random poses."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.skeleton.channels import ABDUCTION, FLEXION
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import Poses, poses_beside_rest
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["CURL", "calibration_poses", "curled", "guard_poses"]

CURL = {"base": 80.0, "knuckle2": 97.0, "knuckle3": 63.0}
"""Flexion [degrees] of a finger's joints in a full curl; the thumb is not curled."""

_WIDEST = np.radians(120.0)  # largest flexion used: beyond, limbs touch each other at shoulders, knees and elbows
_UNKNOWN = np.radians(30.0)  # flexion used where limits are symmetric, so that the joint's direction is not known
_TOE = re.compile(r"^toe\d")
_CURLS = (0.3, 0.6, 0.9)  # fractions of `CURL`
_BETWEEN = (0.4, 0.5, 0.7, 0.8)  # further fractions of `CURL`, of lower priority
_ONE_BY_ONE = (0.45, 0.9)  # fractions of the range of a single digit, the others at rest


def curled(skeleton: Skeleton, amounts: NDArray[np.float64] | list[float] | tuple[float, ...]) -> Poses:
    """Poses with index to pinky of every hand curled by fractions of ``CURL``, one frame a fraction."""
    return poses_beside_rest(skeleton, _curls(skeleton, amounts))


def calibration_poses(skeleton: Skeleton, count: int | None = None) -> Poses:
    """Poses to fit to, over the joint ranges of a skeleton, in order of importance.

    Curls of 0.3, 0.6 and 0.9 and between, digits curled one by one, thumbs opposed and spread, every joint alone at
    its full and half flexion: the volume lost in each pose depends on few joints, so that no joint is fitted to
    compensate for others.

    Args:
        skeleton: The rest skeleton.
        count: Number of poses, taken from each kind in turn; by default all.

    Raises:
        InputError: A skeleton whose joints cannot flex, or a count below 1.
    """
    if count is not None and count < 1:
        raise InputError(f"count: want at least 1 pose, got {count}")
    bends, largest = _range(skeleton)
    kinds = [
        _curls(skeleton, _CURLS),
        _curls(skeleton, _BETWEEN),
        _digits(skeleton, bends, largest),
        _thumbs(skeleton, bends, largest),
        _alone(skeleton, bends, largest, 1.0),
        _alone(skeleton, bends, largest, 0.5),
    ]
    angles = np.concatenate([k for k in kinds if len(k)])
    if count is not None and count < len(angles):
        turn = np.concatenate([np.arange(len(k)) + 0.1 * i for i, k in enumerate(kinds) if len(k)])
        angles = angles[np.sort(np.argsort(turn, kind="stable")[:count])]
    return poses_beside_rest(skeleton, angles)


def guard_poses(skeleton: Skeleton, *, seed: int = 0) -> Poses:
    """Poses that calibration is not fitted to, but that may not get worse, mostly with many joints bent at once.

    Fists (every joint of the digits at 0.5 and 0.8 of its flexion), joints of trunk, arms and legs alone at three
    quarters, and random poses within the limits, the same on both sides of a body.

    Raises:
        InputError: A skeleton whose joints cannot flex.
    """
    bends, largest = _range(skeleton)
    limbs = np.array([j for j in bends if "." not in skeleton.names[j].partition(".")[2]], dtype=np.int64)
    kinds = [
        _fists(skeleton, bends, largest),
        _alone(skeleton, limbs, largest, 0.75),
        _random(skeleton, bends, largest, seed),
    ]
    return poses_beside_rest(skeleton, np.concatenate(kinds))


def _range(skeleton: Skeleton) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Joints that flex, and the largest flexion [rad] of all joints."""
    low, high = np.moveaxis(skeleton.limits[:, FLEXION], -1, 0)
    largest = np.minimum(high, np.where(low <= -high, _UNKNOWN, _WIDEST))
    inner = (skeleton.parents >= 0) & np.array([bool(c) for c in skeleton.children])
    bends = np.flatnonzero(inner & (largest > 1e-6))
    if not bends.size:
        raise InputError("skeleton: none of its joints may flex; want flexion limits above 0 for at least one")
    return bends, largest


def _curls(skeleton: Skeleton, amounts: NDArray[np.float64] | list[float] | tuple[float, ...]) -> NDArray[np.float64]:
    """Angles of :func:`curled`, shape (amounts, J, channels); no frames where the skeleton has no fingers."""
    joints = [
        (j, CURL[name.rpartition(".")[2]])
        for j, name in enumerate(skeleton.names)
        if _digit(name) in DIGITS[:-1] and name.rpartition(".")[2] in CURL
    ]
    if not joints:
        return np.zeros((0, len(skeleton), len(CHANNELS)))
    angles = np.zeros((len(amounts), len(skeleton), len(CHANNELS)))
    for j, full in joints:
        angles[:, j, FLEXION] = np.asarray(amounts) * np.radians(full)
    return angles


def _digits(skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles with single digits curled by ``_ONE_BY_ONE``, on all hands at once, shape (F, J, channels)."""
    full = _curls(skeleton, [1.0])[0] if _curls(skeleton, [1.0]).size else np.zeros((len(skeleton), len(CHANNELS)))
    thumbs = [j for j in bends if _digit(skeleton.names[j]) == DIGITS[-1] and not skeleton.names[j].endswith(".base")]
    full[thumbs, FLEXION] = largest[thumbs]
    digit = np.array([_digit(name) for name in skeleton.names])
    alone = [np.where((digit == d)[:, None], full, 0.0) for d in DIGITS]
    angles = [part * curl for curl in alone if curl.any() for part in _ONE_BY_ONE]
    return np.array(angles).reshape(-1, len(skeleton), len(CHANNELS))


def _fists(skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles with metacarpals and fingers flexed by 0.5 and 0.8 of their range, the thumb opposed and bent."""
    digits = [j for j in bends if _digit(skeleton.names[j])]
    roots = [j for j in bends if skeleton.names[j].endswith("thumb.base")]
    angles = np.zeros((2, len(skeleton), len(CHANNELS)))
    for frame, amount in enumerate((0.5, 0.8)):
        angles[frame, digits, FLEXION] = amount * largest[digits]
        angles[frame, roots, ABDUCTION] = 0.5 * amount * skeleton.limits[roots, ABDUCTION, 0]
    return angles[[bool(digits)] * 2]


def _thumbs(skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles with the thumbs opposed, and spread."""
    roots = [j for j in bends if skeleton.names[j].endswith("thumb.base")]
    angles = np.zeros((2, len(skeleton), len(CHANNELS)))
    for frame, end in ((0, 0), (1, 1)):
        angles[frame, roots, ABDUCTION] = 0.5 * skeleton.limits[roots, ABDUCTION, end]
    angles[0, roots, FLEXION] = largest[roots]
    return angles[[bool(roots)] * 2]


def _random(
    skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64], seed: int, frames: int = 4
) -> NDArray[np.float64]:
    """Random angles: flexion up to the largest, abduction in the inner half of its range, shape (F, J, channels)."""
    generator = np.random.default_rng(seed)
    known, kind = _without_side(skeleton, bends)
    angles = np.zeros((frames, len(skeleton), len(CHANNELS)))
    part = generator.uniform(0.0, 1.0, (frames, 2, len(known)))[:, :, kind]
    angles[:, bends, FLEXION] = part[:, 0] * largest[bends]
    low, high = (np.clip(skeleton.limits[bends, ABDUCTION, k], -_WIDEST / 4, _WIDEST / 4) for k in (0, 1))
    angles[:, bends, ABDUCTION] = 0.5 * (low + part[:, 1] * (high - low))
    return angles


def _alone(
    skeleton: Skeleton, bends: NDArray[np.int64], largest: NDArray[np.float64], part: float
) -> NDArray[np.float64]:
    """Angles with one joint a frame flexed by a part of its range, on both sides of a body at once."""
    known, kind = _without_side(skeleton, bends)
    angles = np.zeros((len(known), len(skeleton), len(CHANNELS)))
    angles[kind, bends, FLEXION] = part * largest[bends]
    return angles


def _without_side(skeleton: Skeleton, joints: NDArray[np.int64]) -> tuple[list[str], NDArray[np.int64]]:
    """Distinct names of joints without their side, in order of appearance, and the index of each joint's name, shape
    (joints,). All toes share one name, so that they are bent together."""
    names = [_TOE.sub("toe", skeleton.names[j].removeprefix("left.").removeprefix("right.")) for j in joints]
    known = list(dict.fromkeys(names))
    return known, np.array([known.index(name) for name in names], dtype=np.int64)


def _digit(name: str) -> str:
    """Name of the digit that a joint belongs to, empty for other joints."""
    parts = name.split(".")
    return parts[-2] if len(parts) > 1 and parts[-2] in DIGITS else ""
