"""Keys, aliases, limits and poses of motions."""

import numpy as np
import pytest

from tests.motion.skeletons import hand
from warpjld.errors import InputError
from warpjld.motion import Motion, Spline
from warpjld.skeleton import CHANNELS, poses_from_angles


def test_values_at_keys_and_in_betweens_are_the_spline() -> None:
    motion = Motion(tension=0.2)
    for frame, value in ((0, 0.0), (10, 0.8), (25, 0.3)):
        motion.set_key("index.base.flexion", frame, value)
    frames = np.linspace(-3, 30, 70)
    np.testing.assert_array_equal(
        motion.value("INDEX.base.flexion", frames), Spline([0, 10, 25], [0, 0.8, 0.3], tension=0.2)(frames)
    )
    assert motion.value("ring.base.flexion", 4.0) == 0.0


def test_values_are_found_without_the_side() -> None:
    motion = Motion()
    motion.set_key("left.index.base.flexion", 0, 0.4)
    assert motion.value("index.base.flexion", 0) == 0.4


def test_last_key_at_a_frame_wins() -> None:
    motion = Motion()
    for value in (0.1, 0.7):
        motion.set_key("wrist.pivot", 5, value)
    assert motion.value("wrist.pivot", 5.0) == 0.7
    assert len(motion.tracks["wrist.pivot"].keys) == 1


def test_aliases_set_the_joints_they_name() -> None:
    skeleton = hand()
    motion = Motion()
    motion.set_key("left.metacarpus.flexion", 0, 0.2)
    motion.set_key("joint 14.flexion", 0, 0.5)
    motion.set_key("left.joint 3.pivot", 0, 0.1)
    angles, _ = motion.sample([0], skeleton)
    expected = {
        ("left.ring.carpometacarpal", "flexion"): 0.2,
        ("left.pinky.carpometacarpal", "flexion"): 0.2,
        ("left.index.knuckle3", "flexion"): 0.5,
        ("left.pinky.base", "pivot"): 0.1,
    }
    for (joint, channel), value in expected.items():
        assert angles[0, skeleton.index(joint), CHANNELS.index(channel)] == value
    assert np.count_nonzero(angles) == len(expected)


def test_root_moves_in_metres() -> None:
    motion = Motion()
    motion.set_key("root.y", 0, 0.0)
    motion.set_key("root.y", 10, 0.5)
    skeleton = hand()
    poses = motion.poses(skeleton)
    assert len(poses) == 11
    np.testing.assert_allclose(poses.positions[10] - skeleton.rest, np.tile([0, 0.5, 0], (25, 1)), atol=1e-12)


def test_poses_are_those_of_the_angles() -> None:
    skeleton = hand()
    motion = Motion()
    motion.set_key("thumb.knuckle2.flexion", 0, 0.0)
    motion.set_key("thumb.knuckle2.flexion", 8, 0.9)
    frames = [0, 2.5, 8]
    angles = np.zeros((3, 25, 4))
    angles[:, skeleton.index("thumb.knuckle2"), 0] = motion.value("thumb.knuckle2.flexion", frames)
    np.testing.assert_array_equal(
        motion.poses(skeleton, frames).rotations, poses_from_angles(skeleton, angles).rotations
    )


def test_key_beyond_its_limit_is_refused_and_named() -> None:
    motion = Motion()
    motion.set_key("index.knuckle2.flexion", 12, np.radians(120))
    with pytest.raises(InputError, match=r"left.index.knuckle2: flexion 120° at frame 12 is above its limit of 100°"):
        motion.poses(hand())
    joint = hand().index("index.knuckle2")
    assert motion.sample([12], hand(), limits="clamp")[0][0, joint, 0] == pytest.approx(np.radians(100))
    assert motion.sample([12], hand(), limits="ignore")[0][0, joint, 0] == pytest.approx(np.radians(120))


def test_in_betweens_beyond_a_limit_are_held_and_reported() -> None:
    motion = Motion()
    for frame, degrees in ((0, 0), (10, 100), (20, 99), (30, 0)):
        motion.set_key("index.knuckle2.flexion", frame, np.radians(degrees))
    skeleton = hand()
    joint = skeleton.index("index.knuckle2")
    assert np.degrees(motion.value("index.knuckle2.flexion", motion.frames)).max() > 101
    angles, _ = motion.sample(motion.frames, skeleton)
    assert np.degrees(angles[:, joint, 0]).max() == pytest.approx(100, abs=1e-9)
    (report,) = motion.clamped(motion.frames, skeleton)
    assert str(report).startswith("left.index.knuckle2.flexion: interpolated values from frame 11 to ")
    assert "limit of 100°" in str(report)


def test_no_report_where_nothing_was_held() -> None:
    motion = Motion()
    motion.set_key("index.knuckle2.flexion", 0, np.radians(100))
    assert motion.clamped([0], hand()) == ()


@pytest.mark.parametrize(
    ("channel", "message"),
    [
        ("index.base.flexon", "no angle 'flexon'.*did you mean flexion"),
        ("flexion", "want 'joint.channel'"),
        ("joint 18.flexion", "numbered 0 to 17"),
        ("metacarpus.pivot", "flexion only"),
        ("root.w", "along x, y or z"),
    ],
)
def test_bad_channels_are_explained(channel: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Motion().set_key(channel, 0, 0.1)


def test_unknown_joint_is_suggested_when_it_meets_a_skeleton() -> None:
    motion = Motion()
    motion.set_key("indx.base.flexion", 0, 0.1)
    with pytest.raises(InputError, match=r"did you mean index.base"):
        motion.poses(hand())


def test_one_channel_under_two_names_is_refused() -> None:
    motion = Motion()
    motion.set_key("index.base.flexion", 0, 0.1)
    motion.set_key("left.index.base.flexion", 5, 0.2)
    with pytest.raises(InputError, match="the same channel"):
        motion.poses(hand())


def test_numbers_must_be_finite() -> None:
    with pytest.raises(InputError, match="finite"):
        Motion().set_key("wrist.flexion", 0, float("nan"))
    with pytest.raises(InputError, match="rate"):
        Motion(rate=0)
