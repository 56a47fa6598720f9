"""The two sides of a bent joint, on a tube whose fold is known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.finger import finger
from warpjld.covering import bind_rig
from warpjld.covering.covering import Covering
from warpjld.geometry.rotations import rotate
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles
from warpjld.touch import Touch

COVERING = bind_rig(finger())
TOUCH = Touch.of(COVERING)
JOINT = 1


def bent(covering: Covering, degrees: float) -> Poses:
    angles = np.zeros((1, len(covering.skeleton), len(CHANNELS)))
    angles[0, JOINT, 0] = np.radians(degrees)
    return poses_from_angles(covering.skeleton, angles)


def height(points: NDArray[np.floating], poses: Poses) -> NDArray[np.float64]:
    """Over the plane that halves the angle, positive beyond the joint [m]."""
    half = poses.rotations[0, JOINT] + poses.rotations[0, JOINT - 1]
    normal = rotate(half, np.array([0.0, 0.0, -1.0]))
    return (np.asarray(points, dtype=np.float64) - poses.positions[0, JOINT]) @ normal


def test_both_sides_stay_on_their_own() -> None:
    rest = COVERING.surface.vertices[:, 2] + 0.05
    near = np.abs(rest) < 0.02
    poses = bent(COVERING, 160.0)
    before = COVERING.deform(poses)
    own = np.sign(-rest) * height(before[0], poses)
    crossed = near & (own < -1e-4)
    assert crossed.sum() >= 4
    after = TOUCH.apply(before, poses)[0]
    own_after = np.sign(-rest) * height(after[0], poses)
    assert own_after[crossed].min() > own[crossed].min() / 2.0
    assert (near & (own_after < -1e-4)).sum() < 0.6 * crossed.sum()


def test_what_does_not_overlap_stays_bit_for_bit() -> None:
    for degrees in (0.0, 20.0, 90.0, 145.0):
        poses = bent(COVERING, degrees)
        before = COVERING.deform(poses)
        np.testing.assert_array_equal(TOUCH.apply(before, poses)[0], before)
    poses = bent(COVERING, 160.0)
    before = COVERING.deform(poses)
    back = COVERING.surface.vertices[:, 1] > 1e-3
    assert back.sum() > 50
    after = TOUCH.apply(before, poses)[0]
    assert (after != before).any()
    np.testing.assert_array_equal(after[0, back], before[0, back])


def test_an_overlap_far_from_the_joint_is_parted_where_it_is() -> None:
    """Both halves of the finger lie in one another along their whole length; near the joint there is room."""
    poses = bent(COVERING, 160.0)
    before = COVERING.deform(poses)
    rest = COVERING.surface.vertices[:, 2] + 0.05
    tall = np.abs(rest) > 0.03
    own = np.sign(-rest) * height(before[0], poses)
    crossed = tall & (own < -5e-4)
    assert crossed.sum() >= 10
    own_after = np.sign(-rest) * height(TOUCH.apply(before, poses)[0][0], poses)
    assert own_after[crossed].mean() > 0.3 * own[crossed].mean()


def test_it_moves_with_the_finger() -> None:
    poses = bent(COVERING, 160.0)
    before = COVERING.deform(poses)
    parted = TOUCH.apply(before, poses)[0]
    away = np.array([0.3, -0.2, 0.1])
    carried = Poses(poses.positions + away, poses.rotations, poses.flexion)
    moved = TOUCH.apply((before + away).astype(np.float32), carried)[0]
    np.testing.assert_allclose(moved, parted + away, atol=2e-6)


def test_without_poses_joints_are_left_alone() -> None:
    poses = bent(COVERING, 160.0)
    before = COVERING.deform(poses)
    assert (TOUCH.apply(before, poses)[0] != before).any()
    np.testing.assert_array_equal(TOUCH.apply(before)[0], before)
