"""A posture on the way leads an arm around what a straight way would pass through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.motion.skeletons import body
from warpjld.skeleton import rest_poses
from warpjld.skeleton.arm import arm_of
from warpjld.skeleton.arm_way import postures_between


def test_a_ball_in_the_way_is_gone_around() -> None:
    skeleton = body()
    arm, pose, angles = arm_of(skeleton, "left"), rest_poses(skeleton), np.zeros((len(skeleton), 4))
    low, high = arm.limits.T
    first, last = 0.4 * low, 0.4 * high
    share = np.linspace(0.0, 1.0, 41)[:, None]

    def wrists(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(arm.chains(angles, values, pose)[0][:, -1])

    ball = wrists((0.5 * (first + last))[None])[0]
    radius = 0.6 * min(np.linalg.norm(wrists(end[None])[0] - ball) for end in (first, last))

    def depths(positions: NDArray[np.float64], _rotations: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.maximum(radius - np.linalg.norm(positions[:, -1:] - ball, axis=2), 0.0)

    assert np.linalg.norm(wrists(first + share * (last - first)) - ball, axis=1).min() < 0.5 * radius
    found = postures_between(arm, angles, pose, first, last, depths, 3)
    assert len(found) == 3
    best = found[0]
    assert ((best >= low) & (best <= high)).all()
    for a, b in ((first, best), (best, last)):
        assert np.linalg.norm(wrists(a + share * (b - a)) - ball, axis=1).min() > 0.97 * radius
