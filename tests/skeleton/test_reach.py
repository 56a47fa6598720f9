"""Arms that reach: the target is met, limits are kept, both sides alike, and what is out of reach is measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.motion.skeletons import body, hand
from warpjld.errors import InputError
from warpjld.skeleton import Poses, Skeleton, poses_from_angles, rest_poses
from warpjld.skeleton.arm import Arm, arm_of
from warpjld.skeleton.reach import Reached, Target, clear, reach

_PALM = np.array([0.0, -1.0, 0.0])
_FORWARD = np.array([0.3, 0.1, 0.9])


def _reach(skeleton: Skeleton, side: str, place: np.ndarray, **more: object) -> tuple[Arm, Reached, Poses]:
    arm = arm_of(skeleton, side)
    angles = np.zeros((len(skeleton), 4))
    body_pose = rest_poses(skeleton)
    target = Target(place, np.zeros(3), **more)  # type: ignore[arg-type]
    found = reach(arm, angles, body_pose, target)
    return arm, found, poses_from_angles(skeleton, found.angles[None])


def _places(skeleton: Skeleton, count: int) -> np.ndarray:
    """Wrists of postures inside the limits: all of them can be reached."""
    arm = arm_of(skeleton, "left")
    rng = np.random.default_rng(5)
    low, high = 0.8 * arm.limits.T
    values = rng.uniform(low, high, size=(count, len(low)))
    return arm.chains(np.zeros((len(skeleton), 4)), values, rest_poses(skeleton))[0][:, -1]


def test_places_that_can_be_reached_are_reached_inside_the_limits() -> None:
    skeleton = body()
    for place in _places(skeleton, 3):
        arm, found, poses = _reach(skeleton, "left", place)
        # by the ordinary kinematics, not by those that the search goes by
        assert np.linalg.norm(poses.positions[0, arm.joints[-1]] - place) < 1e-5
        assert found.short < 1e-5
        values = arm.values(found.angles)
        assert (values >= arm.limits[:, 0] - 1e-9).all()
        assert (values <= arm.limits[:, 1] + 1e-9).all()
        moved = np.zeros(len(skeleton), dtype=bool)
        moved[list(arm.joints)] = True
        assert not found.angles[~moved].any()
        below = np.flatnonzero(~moved & (skeleton.rest[:, 0] <= 0.16))
        np.testing.assert_allclose(poses.positions[0, below], skeleton.rest[below], atol=1e-12)


def test_both_arms_reach_alike() -> None:
    skeleton = body()
    mirrored = skeleton.rest * [-1.0, 1.0, 1.0]
    assert np.allclose(mirrored[skeleton.index("left.wrist")], skeleton.rest[skeleton.index("right.wrist")])
    place = np.array([0.2, 1.2, 0.35])
    arm, left, _ = _reach(skeleton, "left", place)
    assert left.off == 0.0  # there are no aims
    other, right, _ = _reach(skeleton, "right", place * [-1.0, 1.0, 1.0])
    np.testing.assert_allclose(other.values(right.angles), arm.values(left.angles), atol=1e-4)


def test_the_elbow_hangs_below_the_hand_that_is_lifted_before_the_chest() -> None:
    skeleton = body()
    arm, _, poses = _reach(skeleton, "left", np.array([0.15, 1.35, 0.35]))
    elbow, wrist = (poses.positions[0, arm.joints[k]] for k in (arm.elbow, arm.wrist))
    assert elbow[1] < wrist[1] - 0.05
    assert elbow[0] > 0.0  # on its own side


def test_of_what_is_out_of_reach_the_distance_is_told() -> None:
    """On a girdle that does not move: a sphere about the shoulder, as far as the elbow can be opened."""
    skeleton = body()
    limits = skeleton.limits.copy()
    limits[skeleton.index("left.clavicle")] = 0.0
    limits[skeleton.index("left.elbow"), 0, 0] = np.radians(-60.0)
    skeleton = replace(skeleton, limits=limits)
    shoulder = skeleton.rest[skeleton.index("left.shoulder")]
    opened = np.zeros((181, len(skeleton), 4))
    opened[:, skeleton.index("left.elbow"), 0] = np.radians(np.linspace(-60.0, 120.0, 181))
    wrists = poses_from_angles(skeleton, opened).positions[:, skeleton.index("left.wrist")]
    away = np.linalg.norm(wrists - shoulder, axis=1)
    length = away.max()
    # the way that an arm opened as far points at angles inside the shoulder's limits
    pointing = opened[away.argmax()]
    pointing[skeleton.index("left.shoulder")] = np.radians([-30.0, 0.0, 10.0, 20.0])
    way = poses_from_angles(skeleton, pointing[None]).positions[0, skeleton.index("left.wrist")] - shoulder
    way /= np.linalg.norm(way)
    _, found, _ = _reach(skeleton, "left", shoulder + (length + 0.25) * way)
    assert found.short == pytest.approx(0.25, abs=2e-4)
    _, found, _ = _reach(skeleton, "left", shoulder + (length - 0.01) * way)
    assert found.short < 1e-5


def test_the_palm_looks_where_it_is_to_look() -> None:
    skeleton = body()
    look = np.array([0.0, -1.0, 0.0])
    _, found, _ = _reach(skeleton, "left", np.array([0.35, 1.1, 0.25]), aims=((_PALM, look),))
    assert found.short < 1e-4
    assert np.degrees(found.off) < 25.0


def test_a_hand_comes_to_a_place_with_its_rotation() -> None:
    """That of a posture inside the limits."""
    skeleton = body()
    arm, angles = arm_of(skeleton, "left"), np.zeros((len(skeleton), 4))
    low, high = arm.limits.T
    values = low + np.random.default_rng(2).uniform(0.3, 0.7, len(low)) * (high - low)
    positions, rotations = arm.chains(angles, values[None], rest_poses(skeleton))
    turn = Rotation.from_quat(rotations[0, -1])
    aims = tuple((axis, turn.apply(axis)) for axis in np.eye(3)[:2])
    found = reach(arm, angles, rest_poses(skeleton), Target(positions[0, -1], np.zeros(3), aims, exact=True))
    assert found.short < 1e-4
    assert np.degrees(found.off) < 0.1


def test_a_body_that_stands_elsewhere_reaches_the_same_place_beside_it() -> None:
    skeleton = body()
    arm, angles = arm_of(skeleton, "left"), np.zeros((len(skeleton), 4))
    place = np.array([0.2, 1.2, 0.3])
    here = reach(arm, angles, rest_poses(skeleton), Target(place, np.zeros(3)))
    shift = np.array([[3.0, -1.0, 2.0]])
    away = poses_from_angles(skeleton, angles[None], root_position=shift)
    there = reach(arm, angles, away, Target(place + shift[0], np.zeros(3)))
    np.testing.assert_allclose(there.angles, here.angles, atol=1e-5)


def test_a_search_goes_on_from_a_posture_close_by() -> None:
    skeleton = body()
    arm, angles = arm_of(skeleton, "left"), np.zeros((len(skeleton), 4))
    place = np.array([0.35, 1.1, 0.25])
    first = reach(arm, angles, rest_poses(skeleton), Target(place, np.zeros(3)))
    near = Target(place + np.array([0.0, 0.004, 0.0]), np.zeros(3))
    found = reach(arm, angles, rest_poses(skeleton), near, start=arm.values(first.angles))
    assert found.short < 1e-5
    np.testing.assert_allclose(found.angles, first.angles, atol=0.1)


def test_what_must_not_be_entered_comes_before_the_target_if_so_asked() -> None:
    """A target 5 cm inside the wall beyond z = .2."""
    skeleton = body()
    arm, angles = arm_of(skeleton, "left"), np.zeros((len(skeleton), 4))

    def depths(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        return np.maximum(positions[:, [arm.wrist], 2] - 0.2, 0.0)

    target = Target(np.array([0.35, 1.1, 0.25]), np.zeros(3))
    inside = reach(arm, angles, rest_poses(skeleton), target, depths=depths)
    beside = reach(arm, angles, rest_poses(skeleton), target, depths=depths, firm=True)
    assert inside.short < 1e-3
    assert beside.short == pytest.approx(0.05, abs=2e-4)


def test_an_arm_in_a_wall_is_taken_out_of_it() -> None:
    """The wall: everything behind z = .1."""
    skeleton = body()
    arm, angles = arm_of(skeleton, "left"), np.zeros((len(skeleton), 4))

    def depths(positions: np.ndarray, rotations: np.ndarray) -> np.ndarray:
        return np.maximum(0.1 - positions[:, [arm.elbow, arm.wrist], 2], 0.0)

    start = arm.values(angles)
    before = depths(*arm.chains(angles, start[None], rest_poses(skeleton)))
    values = clear(arm, angles, rest_poses(skeleton), start, depths)
    after = depths(*arm.chains(angles, values[None], rest_poses(skeleton)))
    assert before.max() > 0.05
    assert after.max() < 0.1 * before.max()


def test_hands_without_arms_are_refused() -> None:
    with pytest.raises(InputError, match=r"no left arm: .*left\.shoulder"):
        arm_of(hand("left"), "left")
