"""A finger that would go through its own hand closes until it touches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.finger import finger
from warpjld.covering import bind_rig
from warpjld.covering.intersections import crossing_faces
from warpjld.covering.pose_sets import curled
from warpjld.io.rig_file import load_rig
from warpjld.skeleton.kinematics import rest_poses
from warpjld.touch import Touch, close_until_touch

HAND = Path(__file__).resolve().parents[3] / "shared/data/hand_webxr_generic/right.glb"


def test_a_finger_that_touches_nothing_keeps_its_pose() -> None:
    covering = bind_rig(finger())
    poses = rest_poses(covering.skeleton, 2)
    limited, told = close_until_touch(covering, poses, Touch.of(covering))
    np.testing.assert_array_equal(limited.rotations, poses.rotations)
    np.testing.assert_array_equal(limited.positions, poses.positions)
    assert not told


@pytest.mark.skipif(not HAND.exists(), reason="the data folder is not there")
def test_a_closed_hand_has_no_crossing_face_and_says_what_it_did() -> None:
    rig = load_rig(HAND)
    covering = bind_rig(rig)
    touch = Touch.of(covering)
    poses = curled(covering.skeleton, [0.3, 1.0])
    before = covering.deform(poses)
    assert len(crossing_faces(before[1], rig.surface.faces).faces) > 20
    limited, told = close_until_touch(covering, poses, touch, first=4)
    np.testing.assert_array_equal(limited.rotations[0], poses.rotations[0])
    after = touch.apply(covering.deform(limited))[0]
    np.testing.assert_array_equal(after[0], before[0])
    assert not len(crossing_faces(after[1], rig.surface.faces).faces)
    assert told
    for one in told:
        assert one.frame == 5
        assert 0.5 < one.share < 1.0
        assert one.flexion == pytest.approx(240.0 * one.share, abs=1.0)
