"""Interpolation of poses at fractional frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import unit
from warpjld.skeleton.kinematics import Poses

__all__ = ["poses_between"]


def poses_between(poses: Poses, at: NDArray[np.float64]) -> Poses:
    """Poses interpolated at fractional rows (F,); constant before the first and after the last row."""
    at = np.clip(at, 0, len(poses) - 1)
    before = np.floor(at).astype(int)
    after = np.minimum(before + 1, len(poses) - 1)
    part = (at - before)[:, None, None]
    if not len(at):
        return poses[:0]
    start = int(before.min())
    poses, before, after = poses[start : int(after.max()) + 1], before - start, after - start  # may be streamed
    if not part.any():
        return Poses(poses.positions[before], poses.rotations[before], poses.flexion[before])
    first, second = poses.rotations[before], poses.rotations[after]
    # one sign flip per frame: signs are aligned along the joint tree and must stay so
    flip = np.where((first * second).sum((1, 2)) < 0, -1.0, 1.0)[:, None, None]
    rotations = unit((1 - part) * first + part * flip * second)
    positions = (1 - part) * poses.positions[before] + part * poses.positions[after]
    flexion = (1 - part[..., 0]) * poses.flexion[before] + part[..., 0] * poses.flexion[after]
    return Poses(positions, rotations, flexion)
