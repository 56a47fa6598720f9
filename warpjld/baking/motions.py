"""Motions given to fit to, beside the range of motion: most of each is fitted, its end is judged."""

from __future__ import annotations

import numpy as np

from warpjld.baking.poses import NamedPoses, poses_in_a_row, training_poses, unseen_poses
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["with_motions"]

_FITTED, _JUDGED = 120, 24  # frames taken of each motion
_SHARE = 0.75  # of a motion that is fitted; neighbours are nearly equal, so the rest is its end, not every fourth frame
_FEWEST = 8  # frames of which an end is kept


def with_motions(skeleton: Skeleton, motions: list[Poses]) -> tuple[Poses, NamedPoses]:
    """Poses to fit to, and others to judge by."""
    fitted, unseen = [training_poses(skeleton)], unseen_poses(skeleton)
    names, judged = list(unseen.names), [unseen.poses]
    for n, motion in enumerate(motions):
        count = len(motion)
        first = int(_SHARE * count) if count >= _FEWEST else count
        fitted.append(_some(motion[:first], _FITTED))
        if first < count:
            judged.append(_some(motion[first:], _JUDGED))
            names += [f"motion {n + 1}"] * len(judged[-1])
    return poses_in_a_row(fitted), NamedPoses(tuple(names), poses_in_a_row(judged))


def _some(poses: Poses, most: int) -> Poses:
    """Evenly chosen frames."""
    chosen = np.unique(np.linspace(0, len(poses) - 1, min(most, len(poses))).round().astype(int))
    return Poses(poses.positions[chosen], poses.rotations[chosen], poses.flexion[chosen])
