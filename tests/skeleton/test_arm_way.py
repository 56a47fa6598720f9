"""Postures on the way lead an arm around what a straight way would pass through."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tests.motion.skeletons import body
from warpjld.skeleton import rest_poses
from warpjld.skeleton.arm import arm_of
from warpjld.skeleton.arm_way import way_between


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
    found = way_between(arm, angles, pose, first, last, depths)
    way = [first, *found, last]
    for a, b in pairwise(way):
        assert ((b >= low) & (b <= high)).all()
        assert np.linalg.norm(wrists(a + share * (b - a)) - ball, axis=1).min() > 0.9 * radius
    # and where nothing is in the way it is straight
    assert way_between(arm, angles, pose, first, last, lambda p, _r: np.zeros((len(p), 1))) == []
