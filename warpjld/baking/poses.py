"""Training poses for a baked skin, over the whole range of motion, and test poses that are never fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.pose_sets import curled
from warpjld.geometry.rotations import about
from warpjld.skeleton.channels import ABDUCTION, CHANNELS, FLEXION
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import Poses, poses_beside_rest, poses_from_rotations
from warpjld.skeleton.tree import Skeleton

__all__ = ["NamedPoses", "poses_in_a_row", "training_poses", "unseen_poses"]

_WIDE = np.radians(150.0)  # largest angle in training, whatever the limits allow
_UNKNOWN = np.radians(30.0)  # largest angle of channels with wide, symmetric limits, of which nothing is known
_TURN = np.radians(20.0)  # rotation of single joints about the world's axes, since motion files do not respect limits
_SHARES = (0.5, 1.0)  # shares of the limits in poses of single joints
_ASIDE = 0.6  # share of the limits of all channels but flexion in random poses: they seldom reach them together
_RANDOM = 400  # number of random poses


@dataclass(frozen=True, eq=False)
class NamedPoses:
    """Poses with a name each.

    Attributes:
        names: Name of each frame; accuracy is reported by name.
        poses: The poses, as many frames.
    """

    names: tuple[str, ...]
    poses: Poses


def poses_in_a_row(parts: list[Poses]) -> Poses:
    """Concatenation of poses."""
    return Poses(*(np.concatenate([getattr(p, n) for p in parts]) for n in ("positions", "rotations", "flexion")))


def training_poses(skeleton: Skeleton, *, seed: int = 0, random: int = _RANDOM) -> Poses:
    """Every joint alone through its range, every bone turned a little about each axis, and random poses.

    In random poses joints bend together, as in natural motion: each by a share of its range, half of which is common
    to the whole pose.

    Args:
        skeleton: The rest skeleton.
        seed: Seed of the random poses.
        random: Number of random poses.
    """
    low, high = ranges(skeleton)
    inner = _inner(skeleton)
    alone: list[NDArray[np.float64]] = []
    unknown: NDArray[np.bool_] = np.asarray(_unknown(skeleton).all(axis=1))  # these are covered by ``_turned``
    for j, channel in ((j, channel) for j in inner if not unknown[j] for channel in range(len(CHANNELS))):
        for end in (float(low[j, channel]), float(high[j, channel])):
            for share in _SHARES if abs(end) > 1e-6 else ():
                row = np.zeros(low.shape)
                row[j, channel] = share * end
                alone.append(row)
    generator = np.random.default_rng(seed)
    many = np.zeros((random, *low.shape))
    common = generator.uniform(0.0, 1.0, (random, 1, 1))
    own: NDArray[np.float64] = np.asarray(generator.uniform(0.0, 1.0, many.shape))
    # half of the poses bend only some joints, so that the effects of neighbouring joints can be told apart
    moves = generator.uniform(0.0, 1.0, many.shape) < np.where(np.arange(random)[:, None, None] % 2, 0.4, 1.0)
    bent: NDArray[np.float64] = 0.5 * (common + own)
    side = generator.uniform(-1.0, 1.0, many.shape)
    many[..., FLEXION] = np.where(
        generator.uniform(0.0, 1.0, many.shape[:2]) < 0.85,
        bent[..., FLEXION] * high[:, FLEXION],
        own[..., FLEXION] * low[:, FLEXION],
    )
    many[..., 1:] = (np.where(side > 0.0, side * high, -side * low) * _ASIDE)[..., 1:]
    many *= moves
    parts = [poses_beside_rest(skeleton, many), _turned(skeleton, inner)]
    if alone:
        parts.append(poses_beside_rest(skeleton, np.array(alone)))
    return poses_in_a_row(parts)


def unseen_poses(skeleton: Skeleton) -> NamedPoses:
    """Named test poses of hands and bodies, and random ones; those of joints that a skeleton lacks are left out."""
    names: list[str] = []
    parts: list[Poses] = []

    def add(name: str, poses: Poses) -> None:
        names.extend([name] * len(poses))
        parts.append(poses)

    amounts = (0.3, 0.45, 0.6, 0.75, 0.9)
    fingers = _joints(skeleton, lambda words: words[-1] == "base" and words[-2:-1] != ["thumb"])
    if fingers:
        for amount in amounts:
            add(f"curl {amount:g}", curled(skeleton, (amount,)))
        spread = np.zeros((2, len(skeleton), len(CHANNELS)))
        for j in fingers:
            digit = skeleton.names[j].split(".")[-2]
            lean = {"index": 1.0, "middle": 0.3, "ring": -0.5, "pinky": -1.0}.get(digit, 0.0)
            spread[:, j, ABDUCTION] = np.radians([9.0, 17.0]) * lean
        add("spread", poses_beside_rest(skeleton, spread))
    single: tuple[tuple[str, str, tuple[tuple[int, float], ...]], ...] = (
        ("thumb", "thumb.base", ((FLEXION, 12.0), (ABDUCTION, -25.0))),
        ("thumb", "thumb.base", ((ABDUCTION, 25.0),)),
        ("thumb", "thumb.knuckle2", ((FLEXION, 35.0),)),
        ("thumb", "thumb.knuckle3", ((FLEXION, 50.0),)),
        ("wrist", "wrist", ((FLEXION, 60.0),)),
        ("wrist", "wrist", ((FLEXION, -60.0),)),
        ("wrist", "wrist", ((ABDUCTION, 15.0),)),
        ("elbow", "elbow", ((FLEXION, 50.0),)),
        ("elbow", "elbow", ((FLEXION, 120.0),)),
        ("knee", "knee", ((FLEXION, 50.0),)),
        ("knee", "knee", ((FLEXION, 110.0),)),
        ("shoulder", "shoulder", ((FLEXION, 90.0),)),
        ("shoulder", "shoulder", ((ABDUCTION, 90.0),)),
        ("hip", "hip", ((FLEXION, 90.0),)),
    )
    for name, end, channels in single:
        joints = [j for j in _inner(skeleton) if f".{skeleton.names[j]}".endswith(f".{end}")]
        joints = [j for j in joints if skeleton.parents[j] >= 0]
        if joints:
            angles = np.zeros((1, len(skeleton), len(CHANNELS)))
            for channel, degrees in channels:
                angles[0, joints, channel] = np.radians(degrees)
            add(name, poses_beside_rest(skeleton, angles))
    low, high = ranges(skeleton)
    generator = np.random.default_rng(20_000)
    share = generator.uniform(0.0, 0.8, (8, *low.shape)) * (generator.uniform(size=(8, *low.shape)) < 0.5)
    share[..., 1:] *= 0.5
    add("random", poses_beside_rest(skeleton, share * np.where(generator.uniform(size=share.shape) < 0.7, high, low)))
    return NamedPoses(tuple(names), poses_in_a_row(parts))


def ranges(skeleton: Skeleton) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Smallest and largest angle [rad] of every joint's channels in training, shape (J, 4) each; zero for extremities
    and roots."""
    wide: NDArray[np.float64] = np.asarray(np.where(_unknown(skeleton), _UNKNOWN, _WIDE))
    still = np.setdiff1d(np.arange(len(skeleton)), [j for j in _inner(skeleton) if skeleton.parents[j] >= 0])
    low: NDArray[np.float64] = np.clip(skeleton.limits[..., 0], -wide, 0.0)
    high: NDArray[np.float64] = np.clip(skeleton.limits[..., 1], 0.0, wide)
    low[still], high[still] = 0.0, 0.0
    return low, high


def _unknown(skeleton: Skeleton) -> NDArray[np.bool_]:
    """Channels with wide, symmetric limits, whose true range is not known, shape (J, 4)."""
    low, high = skeleton.limits[..., 0], skeleton.limits[..., 1]
    return np.asarray((high >= np.radians(89.0)) & (np.abs(low + high) < 1e-9))


def _turned(skeleton: Skeleton, inner: list[int]) -> Poses:
    """Poses with one bone turned about one of the world's axes, in either direction."""
    turns = [(j, sign * _TURN * np.eye(3)[axis]) for j in inner for axis in range(3) for sign in (1.0, -1.0)]
    local = np.zeros((len(turns) or 1, len(skeleton), 4))
    local[..., 3] = 1.0
    for frame, (j, vector) in enumerate(turns):
        local[frame, j] = about(vector[None])[0]
    return poses_from_rotations(skeleton, local)


def _inner(skeleton: Skeleton) -> list[int]:
    """Joints with children, at which a bone begins."""
    return [j for j, children in enumerate(skeleton.children) if children]


def _joints(skeleton: Skeleton, wanted: Callable[[list[str]], bool]) -> list[int]:
    """Joints of digits whose name, split at its dots, satisfies a condition."""
    split = ((j, name.split(".")) for j, name in enumerate(skeleton.names))
    return [j for j, words in split if len(words) > 1 and words[-2] in DIGITS and wanted(words)]
