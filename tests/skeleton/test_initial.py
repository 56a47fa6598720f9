"""Rest poses that are bent: angles count from the straight joint (R25)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.skeleton.test_kinematics import chain
from warpjld.errors import InputError
from warpjld.geometry.rotations import rotate
from warpjld.motion import Motion
from warpjld.skeleton import CHANNELS, Skeleton, poses_from_angles, rest_poses
from warpjld.skeleton.initial import bent_as_before, bent_limbs, check_initial, with_initial

ANGLES = st.lists(st.floats(-1.2, 1.2), min_size=12, max_size=12).map(lambda x: np.array(x).reshape(3, 4))


def digitised(straight: Skeleton, initial: np.ndarray) -> Skeleton:
    """The skeleton that a digitiser finds of a straight one posed so."""
    pose = poses_from_angles(straight, initial[None])
    return replace(straight, rest=pose.positions[0], axes=rotate(pose.rotations[0], straight.axes), initial=initial)


@pytest.mark.parametrize("side", ["left", "right"])
@given(initial=ANGLES, angles=ANGLES)
def test_a_bent_rest_pose_moves_as_the_straight_one_does(side: str, initial: np.ndarray, angles: np.ndarray) -> None:
    straight = chain(side)
    bent = digitised(straight, initial)
    one, other = (poses_from_angles(s, angles[None]) for s in (straight, bent))
    np.testing.assert_allclose(other.positions, one.positions, atol=1e-9)
    np.testing.assert_allclose(other.flexion[:, :2], one.flexion[:, :2], atol=1e-7)


@given(initial=ANGLES)
def test_at_its_initial_angles_it_is_at_rest(initial: np.ndarray) -> None:
    bent = digitised(chain(), initial)
    poses = rest_poses(bent)
    np.testing.assert_allclose(poses.positions[0], bent.rest, atol=1e-12)
    np.testing.assert_allclose(poses.rotations, np.tile([0, 0, 0, 1.0], (1, 3, 1)), atol=1e-12)


def test_what_nothing_moves_stays_at_rest_between_keys() -> None:
    initial = np.zeros((3, 4))
    initial[1, 0] = 0.7
    bent = digitised(chain(), initial)
    motion = Motion()
    motion.set_key("right.index.base.flexion", 0, 0.2)
    angles, _ = motion.sample([0, 3], bent)
    np.testing.assert_allclose(angles[:, 1, 0], 0.7)
    np.testing.assert_allclose(angles[:, 0, 0], 0.2)


def arm(bend: float) -> Skeleton:
    """An arm along x whose elbow is bent forward by some degrees."""
    names = ("left.shoulder", "left.elbow", "left.wrist")
    upper, lower = np.array([0.3, 0, 0]), 0.25 * np.array([np.cos(np.radians(bend)), 0, np.sin(np.radians(bend))])
    limits = np.zeros((3, len(CHANNELS), 2))
    limits[1, 0] = np.radians([0, 150])
    rest = np.array([np.zeros(3), upper, upper + lower])
    return Skeleton(names, np.array([-1, 0, 1], np.int32), rest, np.tile([0.0, -1.0, 0.0], (3, 1)), limits)


@pytest.mark.parametrize("bend", [3.0, 20.0, 75.0])
def test_a_bent_elbow_straightens_at_zero(bend: float) -> None:
    bent, notes = with_initial(arm(bend), {})
    assert np.degrees(bent.initial[1, 0]) == pytest.approx(bend, abs=1e-9)
    assert notes == (f"bent at rest: left.elbow by {bend:.1f}°; angles count from the straight joint",)
    hand = poses_from_angles(bent, np.zeros((1, 3, 4))).positions[0, 2]
    np.testing.assert_allclose(hand, [0.55, 0, 0], atol=1e-12)


def test_straight_and_overstretched_elbows_and_what_is_stated_are_left() -> None:
    assert not bent_limbs(arm(0.0))
    assert not bent_limbs(arm(-8.0))
    stated, notes = with_initial(arm(20.0), {1: {"flexion": 0.0}})
    assert not stated.initial.any()
    assert notes == ()


def test_beyond_the_limits_is_refused() -> None:
    with pytest.raises(InputError, match=r"'left.elbow': initial flexion 160° is beyond its limits, 0° to 150°"):
        with_initial(arm(20.0), {1: {"flexion": np.radians(160.0)}})
    check_initial(arm(20.0))


def test_moved_axes_and_joints_take_derived_angles_anew() -> None:
    bent, _ = with_initial(arm(20.0), {})
    tilted = bent.with_axes(np.tile([0.0, -1.0, 0.5], (3, 1)))
    again = bent_as_before(bent, tilted)
    assert np.degrees(again.initial[1, 0]) != pytest.approx(20.0, abs=0.1)
    assert again.initial[1, 0] == bent_limbs(tilted)[1]
    stated, _ = with_initial(arm(20.0), {1: {"flexion": 0.3}})
    assert bent_as_before(stated, replace(stated, axes=tilted.axes)).initial[1, 0] == 0.3
