"""Poses for tests."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles


def random_poses(skeleton: Skeleton, frames: int, seed: int, *, share: float = 1.0, twist: float = 0.0) -> Poses:
    """Every channel anywhere inside its limits, and the root moved and turned.

    Args:
        skeleton: The skeleton.
        frames: How many.
        seed: Of the generator.
        share: Portion of the way from rest to the limits.
        twist: Twisting added to every joint, up to this angle either way [rad], limits or not.
    """
    rng = np.random.default_rng(seed)
    low, high = np.moveaxis(skeleton.limits, -1, 0)
    angles = share * rng.uniform(low, high, (frames, *low.shape))
    angles[..., CHANNELS.index("twisting")] += rng.uniform(-twist, twist, angles.shape[:2])
    turn = Rotation.random(frames, rng=rng).as_quat()
    return poses_from_angles(skeleton, angles, root_position=rng.uniform(-0.5, 0.5, (frames, 3)), root_rotation=turn)
