"""Tracked hands: directions are followed whatever the bone lengths, sides mirror, real recordings look as named."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.motion.skeletons import body, hand, rig, with_forearm
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.hand_file import read_hands
from warpjld.motion.hand_track import HandTrack
from warpjld.motion.hands_drive import poses_of_hands
from warpjld.motion.webxr import WEBXR_JOINTS
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, DIGITS, Poses, Skeleton, poses_from_angles

PHALANGES = [
    (f"{digit}.{a}", f"{digit}.{b}")
    for digit in DIGITS
    for a, b in (("base", "knuckle2"), ("knuckle2", "knuckle3"), ("knuckle3", "tip"))
]
MIRROR = np.array([-1.0, 1.0, 1.0])


def recorded(skeleton: Skeleton, poses: Poses, **changes: object) -> HandTrack:
    """The joints of poses as a tracker would see them."""
    side = skeleton.names[0].partition(".")[0]
    points = {name.partition(".")[2]: poses.positions[:, j] for j, name in enumerate(skeleton.names)}
    return HandTrack(side, np.arange(len(poses)) / 10, points, **changes)  # type: ignore[arg-type]


def poses_of_hand(track: HandTrack, skeleton: Skeleton, rate: float) -> Poses:
    return poses_of_hands((track,), skeleton, rate)[0]


def only_hand(path: Path) -> tuple[HandTrack, float]:
    recording = read_hands(path)
    (track,) = recording.hands
    assert isinstance(track, HandTrack)
    return track, recording.rate


def gesture(skeleton: Skeleton, seed: int = 0, frames: int = 4, travel: float = 1.0) -> Poses:
    """Random flexions and spreads, starting from rest; the metacarpals do not move."""
    rng = np.random.default_rng(seed)
    angles = np.zeros((frames, len(skeleton), 4))
    for j, name in enumerate(skeleton.names):
        if name.endswith(("base", "knuckle2", "knuckle3")):
            angles[1:, j, CHANNELS.index("flexion")] = rng.uniform(0.1, 1.2, frames - 1)
        if name.endswith("base"):
            angles[1:, j, CHANNELS.index("abduction")] = rng.uniform(-0.3, 0.3, frames - 1)
    turn = Rotation.from_rotvec(
        rng.normal(scale=0.5 * travel, size=(frames, 3)) * np.arange(frames).clip(0, 1)[:, None]
    )
    root = rng.normal(scale=0.1 * travel, size=(frames, 3)) * np.arange(frames).clip(0, 1)[:, None]
    return poses_from_angles(skeleton, angles, root_position=root, root_rotation=turn.as_quat())


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_a_hand_follows_itself(seed: int) -> None:
    skeleton = hand()
    wanted = gesture(skeleton, seed)
    got = poses_of_hand(recorded(skeleton, wanted), skeleton, 10.0)
    np.testing.assert_allclose(got.positions, wanted.positions, atol=1e-9)


def test_other_sizes_places_and_orientations_change_directions_not_lengths() -> None:
    skeleton = hand()
    wanted = gesture(skeleton)
    turn = Rotation.from_euler("xyz", [1, 2, 3])
    track = recorded(skeleton, wanted)
    points = {name: 1300 * turn.apply(place) + [5, 6, 7] for name, place in track.points.items()}
    got = poses_of_hand(HandTrack("left", track.times, points), skeleton, 10.0)
    np.testing.assert_allclose(got.positions, wanted.positions, atol=1e-9)


def test_longer_phalanges_give_the_same_poses() -> None:
    skeleton = hand()
    wanted = gesture(skeleton)
    track = recorded(skeleton, wanted)
    points = dict(track.points)
    for digit in DIGITS:
        for a, b in (("base", "knuckle2"), ("knuckle2", "knuckle3"), ("knuckle3", "tip")):
            bone = track.points[f"{digit}.{b}"] - track.points[f"{digit}.{a}"]
            points[f"{digit}.{b}"] = points[f"{digit}.{a}"] + 1.4 * bone
    got = poses_of_hand(HandTrack("left", track.times, points), skeleton, 10.0)
    np.testing.assert_allclose(got.positions, wanted.positions, atol=1e-9)


def test_a_right_recording_drives_a_left_hand_as_its_mirror_image() -> None:
    right, left = hand("right"), hand("left")
    wanted = gesture(right)
    got = poses_of_hand(recorded(right, wanted), left, 10.0)
    np.testing.assert_allclose(got.positions, wanted.positions * MIRROR, atol=1e-9)


def test_metacarpals_flex_within_their_limits() -> None:
    skeleton = hand()
    angles = np.zeros((3, len(skeleton), 4))
    pinky = skeleton.index("pinky.carpometacarpal")
    angles[:, pinky, 0] = np.radians([0, 12, 35])
    track = recorded(skeleton, poses_from_angles(skeleton, angles), moves=False)
    got = np.degrees(poses_of_hand(track, skeleton, 10.0).flexion[:, pinky])
    np.testing.assert_allclose(got, [0, 12, 20], atol=1e-9)


def test_fingers_only_leave_the_wrist_where_it_rests() -> None:
    skeleton = hand()
    got = poses_of_hand(recorded(skeleton, gesture(skeleton), moves=False), skeleton, 10.0)
    np.testing.assert_allclose(got.positions[:, 0], np.zeros((4, 3)), atol=1e-12)
    np.testing.assert_allclose(got.rotations[:, 0], np.tile([0, 0, 0, 1.0], (4, 1)), atol=1e-12)


def test_a_stub_of_forearm_moves_with_the_whole_hand() -> None:
    bare = hand()
    skeleton = with_forearm(bare)
    wanted = gesture(bare)
    got = poses_of_hand(recorded(bare, wanted), skeleton, 10.0)
    np.testing.assert_allclose(got.positions[:, 1:], wanted.positions, atol=1e-9)
    np.testing.assert_allclose(got.rotations[:, 0], got.rotations[:, 1], atol=1e-12)


def test_other_rates_interpolate() -> None:
    skeleton = hand()
    track = recorded(skeleton, gesture(skeleton))
    got = poses_of_hand(track, skeleton, 20.0)
    assert len(got) == 7
    np.testing.assert_allclose(got.positions[::2], poses_of_hand(track, skeleton, 10.0).positions, atol=1e-9)


def test_a_rig_without_hands_is_refused() -> None:
    skeleton = hand()
    names = tuple(name.replace("wrist", "stump") for name in skeleton.names)
    stump = Skeleton(names, skeleton.parents, skeleton.rest, skeleton.axes, skeleton.limits)
    with pytest.raises(InputError, match="no hand"):
        poses_of_hand(recorded(skeleton, gesture(skeleton)), stump, 10.0)


def test_a_body_moves_its_fingers_only() -> None:
    source, target = hand("right"), body()
    got = poses_of_hand(recorded(source, gesture(source)), target, 10.0)
    still = [j for j, name in enumerate(target.names) if ".index" not in name and ".thumb" not in name]
    np.testing.assert_allclose(got.positions[:, still], np.tile(target.rest[still], (4, 1, 1)), atol=1e-12)
    assert np.abs(got.flexion[:, target.index("right.index.knuckle2")]).max() > 0.1
    assert np.abs(got.flexion[:, target.index("left.index.knuckle2")]).max() == 0.0


def webxr(skeleton: Skeleton, poses: Poses) -> dict:
    out: dict = {}
    for frame, positions in enumerate(poses.positions):
        out[f"pose {frame}"] = {"_gripOffsetMatrix": [0] * 16}
        for joint, canonical in WEBXR_JOINTS.items():
            matrix = np.eye(4)
            matrix[:3, 3] = positions[skeleton.index(canonical)]
            out[f"pose {frame}"][joint] = {"offsetMatrix": matrix.T.ravel().tolist(), "radius": 0.01}
    return out


def leap(skeleton: Skeleton, poses: Poses, *, packed: bool) -> dict:
    """A recording in millimetres, 100 frames a second, a lost frame in the middle; thumbs have an idle metacarpal."""
    fields = {"carpPosition": "carpometacarpal", "mcpPosition": "base", "pipPosition": "knuckle2"} | {
        "dipPosition": "knuckle3",
        "tipPosition": "tip",
    }
    frames: list = []
    for number, positions in enumerate(poses.positions):
        fingers = []
        for kind, digit in enumerate(("thumb", "index", "middle", "ring", "pinky")):
            finger: dict = {"id": 70 + kind, "handId": 7, "tool": False}
            for field, joint in fields.items():
                name = f"{digit}.{'base' if digit == 'thumb' and joint == 'carpometacarpal' else joint}"
                finger[field] = (1000 * positions[skeleton.index(name)]).tolist()
            fingers.append(finger)
        hands = [{"id": 7, "type": skeleton.names[0].partition(".")[0]}]
        frames.append({"timestamp": 5_000_000 + number * 10_000, "hands": hands, "pointables": fingers})
        if number == 1:
            frames.append({"timestamp": 5_015_000, "hands": [], "pointables": []})
    if packed:
        keys = list(frames[0]["pointables"][0])
        header = ["timestamp", {"hands": [["id", "type"]]}, {"pointables": [keys]}, {"interactionBox": ["centre"]}]
        rows = [
            [f["timestamp"], [list(h.values()) for h in f["hands"]], [list(p.values()) for p in f["pointables"]], [0]]
            for f in frames
        ]
        frames = [header, *rows]
    return {"metadata": {}, "frames": frames}


def save(folder: Path, content: object) -> Path:
    path = folder / "hand.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("side", ["left", "right"])
def test_webxr_poses_tell_their_side_and_are_a_second_apart(tmp_path: Path, side: str) -> None:
    skeleton = hand(side)
    wanted = gesture(skeleton, travel=0.0)
    track, rate = only_hand(path := save(tmp_path, webxr(skeleton, wanted)))
    assert (track.side, rate, track.moves) == (None, 1.0, False)
    moved = load_motion(path, rig(skeleton), rate=4)
    assert f"fingers bend as a {side} hand's" in moved.notes[0]
    poses, rate = moved.poses, moved.rate
    assert (len(poses), rate) == (13, 4)
    np.testing.assert_allclose(poses.positions[::4], wanted.positions, atol=1e-9)


@pytest.mark.parametrize("packed", [False, True])
def test_leap_recordings_of_both_formats(tmp_path: Path, packed: bool) -> None:
    skeleton = hand("right")
    wanted = gesture(skeleton)
    moved = load_motion(save(tmp_path, leap(skeleton, wanted, packed=packed)), rig(skeleton))
    poses, rate = moved.poses, moved.rate
    assert rate == 100.0
    np.testing.assert_allclose(poses.positions, wanted.positions, atol=1e-9)


def test_mistakes_in_recordings_are_named(tmp_path: Path) -> None:
    skeleton = hand("right")
    poses = gesture(skeleton)
    broken = leap(skeleton, poses, packed=False)
    del broken["frames"][3]["pointables"][2]["dipPosition"]
    with pytest.raises(InputError, match=r"hand.json: frame 3: .*middle without dipPosition"):
        only_hand(save(tmp_path, broken))
    broken = leap(skeleton, poses, packed=False)
    broken["frames"][3]["timestamp"] = 0
    with pytest.raises(InputError, match="frame 3: its timestamp"):
        only_hand(save(tmp_path, broken))
    broken["frames"][3]["timestamp"] = float("inf")
    with pytest.raises(InputError, match="frame 3: its timestamp"):
        only_hand(save(tmp_path, broken))
    broken = leap(skeleton, poses, packed=False)
    broken["frames"][1]["pointables"][1]["tipPosition"] = [1, 2]
    with pytest.raises(InputError, match=r"'index.tip' needs three finite coordinates"):
        only_hand(save(tmp_path, broken))
    broken = leap(skeleton, poses, packed=True)
    broken["frames"][2][1] = 5
    with pytest.raises(InputError, match="packed frames do not fit"):
        only_hand(save(tmp_path, broken))
    broken = webxr(skeleton, poses)
    broken["pose 2"]["wrist"]["offsetMatrix"] = [1, 2]
    with pytest.raises(InputError, match="pose 'pose 2': the offsetMatrix of 'wrist'"):
        only_hand(save(tmp_path, broken))
    del broken["pose 1"]["thumb-tip"]
    with pytest.raises(InputError, match="pose 'pose 1': no 'thumb-tip'"):
        only_hand(save(tmp_path, broken))
    for content, message in (
        ({"frames": []}, "no frames"),
        ({"a": 1}, "no hand recording"),
        ([1], "no hand recording"),
    ):
        with pytest.raises(InputError, match=message):
            only_hand(save(tmp_path, content))
    (tmp_path / "hand.json").write_text('{"a": 1,\n oops}')
    with pytest.raises(InputError, match=r"hand.json:2:2: is not JSON"):
        only_hand(tmp_path / "hand.json")


LEAP = "motion_leap_grab_pinch_splay"


def real_rig(data: Path) -> Rig:
    return load_rig(data / "hand_webxr_generic" / "left.glb")


@pytest.mark.parametrize("name", [f"{LEAP}/grab.json", f"{LEAP}/pinch-57fps.json", f"{LEAP}/HandSplay-110fps.json"])
def test_real_recordings_are_followed_phalanx_by_phalanx(data: Path, name: str) -> None:
    driven = real_rig(data)
    track, rate = only_hand(data / name)
    assert track.side == "right"
    poses = poses_of_hand(track, driven.skeleton, rate)
    turn, _ = Rotation.align_vectors(  # the deformed hand lies as the mirrored recording does
        *(
            np.array([vectors[b][0] - vectors[a][0] for a, b in PHALANGES])
            for vectors in (
                {k: poses.positions[:, driven.skeleton.index(k)] for pair in PHALANGES for k in pair},
                track.mirrored().points,
            )
        )
    )
    for a, b in PHALANGES:
        own = poses.positions[0, driven.skeleton.index(b)] - poses.positions[0, driven.skeleton.index(a)]
        theirs = turn.apply(track.mirrored().points[b][0] - track.mirrored().points[a][0])
        cosine = own @ theirs / np.linalg.norm(own) / np.linalg.norm(theirs)
        assert np.degrees(np.arccos(np.clip(cosine, -1, 1))) < 1e-3


def test_grabbing_curls_and_pinching_brings_thumb_and_index_together(data: Path) -> None:
    driven = real_rig(data)
    skeleton = driven.skeleton
    grab = load_motion(data / LEAP / "grab.json", driven).poses
    curl = np.degrees(grab.flexion[:, [skeleton.index(f"{d}.knuckle2") for d in DIGITS[:4]]]).mean(axis=1)
    assert curl.min() < 25
    assert curl.max() > 60
    pinch = load_motion(data / LEAP / "pinch-57fps.json", driven).poses
    gap = np.linalg.norm(
        pinch.positions[:, skeleton.index("thumb.tip")] - pinch.positions[:, skeleton.index("index.tip")], axis=-1
    )
    assert gap.min() < 0.03 < 0.05 < gap.max()


def test_webxr_poses_of_another_hand_are_left_and_point(data: Path) -> None:
    driven = real_rig(data)
    path = data / "motion_iwer_webxr_poses" / "poses.json"
    assert "fingers bend as a left hand's" in load_motion(path, driven).notes[0]
    moved = load_motion(path, driven)
    poses, rate = moved.poses, moved.rate
    assert (len(poses), rate) == (3, 1.0)
    bends = np.degrees(poses.flexion[2])
    assert bends[driven.skeleton.index("index.knuckle2")] < 15
    assert min(bends[driven.skeleton.index(f"{d}.knuckle2")] for d in ("middle", "ring", "pinky")) > 60
