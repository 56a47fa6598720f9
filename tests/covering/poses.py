"""Poses for tests."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles


def random_angles(skeleton: Skeleton, frames: int, seed: int) -> np.ndarray:
    """Every channel anywhere inside its limits, shape (frames, J, 4)."""
    low, high = np.moveaxis(skeleton.limits, -1, 0)
    return np.random.default_rng(seed).uniform(low, high, (frames, *low.shape))


def random_poses(skeleton: Skeleton, frames: int, seed: int, *, twist: float = 0.0) -> Poses:
    """Every channel anywhere inside its limits, and the root moved and turned.

    Args:
        skeleton: The skeleton.
        frames: How many.
        seed: Of the generator.
        twist: Twisting added to every joint, up to this angle either way [rad], limits or not.
    """
    rng = np.random.default_rng(seed + 1)
    angles = random_angles(skeleton, frames, seed)
    angles[..., CHANNELS.index("twisting")] += rng.uniform(-twist, twist, angles.shape[:2])
    turn = Rotation.random(frames, rng=rng).as_quat()
    return poses_from_angles(skeleton, angles, root_position=rng.uniform(-0.5, 0.5, (frames, 3)), root_rotation=turn)
