"""Training and test poses from given motions: the beginning of each is for training, its end for testing."""

from __future__ import annotations

import numpy as np

from warpjld.baking.poses import NamedPoses, poses_in_a_row, training_poses, unseen_poses
from warpjld.skeleton.kinematics import Poses
from warpjld.skeleton.tree import Skeleton

__all__ = ["with_motions"]

_FITTED, _JUDGED = 120, 24  # largest numbers of training and test frames of each motion
_SHARE = 0.75  # share of a motion for training; the rest is its end, since interleaved frames would be nearly equal
_FEWEST = 8  # smallest number of frames of a motion whose end is kept for testing


def with_motions(skeleton: Skeleton, motions: list[Poses]) -> tuple[Poses, NamedPoses]:
    """Training poses over the range of motion and of these motions, and named test poses likewise."""
    fitted, unseen = [training_poses(skeleton)], unseen_poses(skeleton)
    names, judged = list(unseen.names), [unseen.poses]
    for n, motion in enumerate(motions):
        count = len(motion)
        first = int(_SHARE * count) if count >= _FEWEST else count
        fitted.append(_subsampled(motion[:first], _FITTED))
        if first < count:
            judged.append(_subsampled(motion[first:], _JUDGED))
            names += [f"motion {n + 1}"] * len(judged[-1])
    return poses_in_a_row(fitted), NamedPoses(tuple(names), poses_in_a_row(judged))


def _subsampled(poses: Poses, most: int) -> Poses:
    """At most ``most`` evenly spaced frames."""
    chosen = np.unique(np.linspace(0, len(poses) - 1, min(most, len(poses))).round().astype(int))
    return Poses(poses.positions[chosen], poses.rotations[chosen], poses.flexion[chosen])
