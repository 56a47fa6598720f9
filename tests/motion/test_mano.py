"""MANO-family poses against forward kinematics of their own, and the way back."""

import pickle
import zipfile
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from tests.motion.hand_files import POSTURES, postures, save
from tests.motion.skeletons import hand, rig, with_forearm
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion
from warpjld.motion.hand_file import read_hands
from warpjld.motion.out import write_motion
from warpjld.skeleton import Poses, Skeleton, default_limits, hand_joint_names, rest_poses
from warpjld.skeleton.hand import HAND_PARENTS

ORDER = ("index", "middle", "pinky", "ring", "thumb")
ACROSS = {"index": 0.025, "middle": 0.003, "ring": -0.02, "pinky": -0.04}
KNUCKLES = ("base", "knuckle2", "knuckle3", "tip")


def rest_joints(side: str) -> dict[str, NDArray[np.float64]]:
    """A flat hand as MANO rests: the right one's fingers to -x, the left one's to +x, backs to +y, thumbs to +z."""
    points = {"wrist": np.array([0.09, 0.005, 0.005])}
    for finger, z in ACROSS.items():
        points[f"{finger}.carpometacarpal"] = np.array([0.07, 0.005, 0.005 + 0.5 * z])
        for k, joint in enumerate(KNUCKLES):
            points[f"{finger}.{joint}"] = np.array([0.0 - 0.03 * k, 0.005, 0.005 + z * (1.0 + 0.1 * k)])
    for k, joint in enumerate(KNUCKLES):
        points[f"thumb.{joint}"] = np.array([0.065 - 0.021 * k, -0.01 - 0.002 * k, 0.03 + 0.02 * k])
    mirror = np.array([1.0 if side == "right" else -1.0, 1.0, 1.0])
    return {name: points[name] * mirror for name in HAND_PARENTS}


def turned(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrix of an axis-angle vector, as the exponential of its cross product's matrix."""
    x, y, z = vector
    return np.asarray(expm(np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])))


def directions(side: str, pose: NDArray[np.float64], orient: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit directions of the fifteen phalanges of one frame in MANO's axes, in ``ORDER``, shape (15, 3)."""
    rest = rest_joints(side)
    out = []
    for d, digit in enumerate(ORDER):
        world = turned(orient)
        for k in range(3):
            world = world @ turned(pose[3 * d + k])
            bone = rest[f"{digit}.{KNUCKLES[k + 1]}"] - rest[f"{digit}.{KNUCKLES[k]}"]
            out.append(world @ bone / np.linalg.norm(bone))
    return np.array(out)


def mano_rig(side: str, turn: NDArray[np.float64], stretch: float = 1.0) -> Skeleton:
    """A rig of that hand, lying elsewhere and with other bone lengths along the fingers."""
    rest = rest_joints(side)
    points = dict(rest)
    for digit in ORDER:
        for a, b in pairwise(KNUCKLES):
            points[f"{digit}.{b}"] = points[f"{digit}.{a}"] + stretch * (rest[f"{digit}.{b}"] - rest[f"{digit}.{a}"])
    bare = list(HAND_PARENTS)
    parents = np.array([-1 if p is None else bare.index(p) for p in HAND_PARENTS.values()], dtype=np.int32)
    axes = np.tile(turn @ [0.0, 0.0, 1.0 if side == "right" else -1.0], (len(bare), 1))
    places = np.array([turn @ point + [1.0, 2.0, 3.0] for point in points.values()])
    return Skeleton(hand_joint_names(side), parents, places, axes, default_limits(hand_joint_names(side)))


def random_pose(side: str, frames: int, seed: int = 0) -> NDArray[np.float64]:
    """Curls about the flexion axis, and some twist and spread, shape (F, 15, 3)."""
    rng = np.random.default_rng(seed)
    sign = 1.0 if side == "right" else -1.0
    pose = rng.normal(scale=0.1, size=(frames, 15, 3))
    pose[..., 2] += sign * rng.uniform(0.1, 1.2, size=(frames, 15))
    return pose


def phalanges(skeleton: Skeleton, positions: NDArray[np.float64]) -> NDArray[np.float64]:
    out = []
    for digit in ORDER:
        for a, b in pairwise(KNUCKLES):
            bone = positions[:, skeleton.index(f"{digit}.{b}")] - positions[:, skeleton.index(f"{digit}.{a}")]
            out.append(bone / np.linalg.norm(bone, axis=-1, keepdims=True))
    return np.stack(out, axis=1)


def angles(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1.0, 1.0))))


TURNS = {"as MANO": np.eye(3), "axes": turned(np.array([0.0, np.pi / 2, 0.0])) @ turned(np.array([np.pi, 0.0, 0.0]))}


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("lying", list(TURNS))
@pytest.mark.parametrize("width", [45, 48, 51])
def test_phalanges_point_where_forward_kinematics_say(tmp_path: Path, side: str, lying: str, width: int) -> None:
    turn, frames = TURNS[lying], 5
    skeleton = mano_rig(side, turn, stretch=1.3)
    pose = random_pose(side, frames)
    rng = np.random.default_rng(1)
    orient, place = rng.normal(size=(2, frames, 3))
    numbers = np.concatenate([orient, pose.reshape(frames, 45), place], axis=1)
    numbers = {45: numbers[:, 3:48], 48: numbers[:, :48], 51: numbers}[width]
    path = save(tmp_path, {"pose": numbers.tolist(), "flat_hand_mean": True, "fps": 24})
    loaded = load_motion(path, rig(skeleton))
    assert loaded.rate == 24
    assert any(f"fingers bend as a {side} hand's" in note for note in loaded.notes)
    assert any("MANO's own order" in note for note in loaded.notes)
    still = np.zeros(3)
    base = turned(orient[0])
    for f in range(frames):
        wrist = still if width == 45 else orient[f]
        wanted = directions(side, pose[f], wrist)
        if width > 45:  # it rests in the first frame, and turns from there
            wanted = wanted @ base
        np.testing.assert_allclose(phalanges(skeleton, loaded.poses.positions)[f], wanted @ turn.T, atol=1e-9)
        if width == 51:
            moved = loaded.poses.positions[f, 0] - skeleton.rest[0]
            np.testing.assert_allclose(moved, turn @ base.T @ (place[f] - place[0]), atol=1e-9)


def test_hands_that_rest_bent_or_askew_become_flat(data: Path, tmp_path: Path) -> None:
    askew = turned(np.array([0.4, 0.9, -0.3]))
    skeleton = mano_rig("right", askew)
    pose = random_pose("right", 4)
    fields = {"hand_pose": pose.reshape(4, 45).tolist(), "flat_hand_mean": True, "is_rhand": True}
    loaded = load_motion(save(tmp_path, fields), rig(skeleton))
    wanted = np.array([directions("right", p, np.zeros(3)) @ askew.T for p in pose])
    # axes that are read off the knuckles, not off the model: the palm's tilt against its axes remains
    assert angles(phalanges(skeleton, loaded.poses.positions), wanted).max() < 8.0
    for file in ("hand_anny/right.glb", "hand_godot_low/Hand_low_R.gltf", "hand_webxr_generic/right.glb"):
        driven = load_rig(data / file)
        flat = load_motion(save(tmp_path, fields | {"hand_pose": np.zeros((1, 45)).tolist()}), driven)
        bones = phalanges(driven.skeleton, flat.poses.positions)[0].reshape(5, 3, 3)
        assert angles(bones[:4, :-1], bones[:4, 1:]).max() < 20.0
        fist = np.zeros((1, 15, 3))
        fist[:, :12, 2] = np.radians(70.0)
        curled = load_motion(save(tmp_path, fields | {"hand_pose": fist.reshape(1, 45).tolist()}), driven)
        bones = phalanges(driven.skeleton, curled.poses.positions)[0].reshape(5, 3, 3)
        np.testing.assert_allclose(angles(bones[:4, :-1], bones[:4, 1:]), 70.0, atol=15.0)
        tips = [driven.skeleton.index(f"{finger}.tip") for finger in ORDER[:4]]
        wrist = driven.skeleton.index("wrist")
        reach = np.linalg.norm(curled.poses.positions[0, tips] - curled.poses.positions[0, wrist], axis=-1)
        open_reach = np.linalg.norm(flat.poses.positions[0, tips] - flat.poses.positions[0, wrist], axis=-1)
        assert (reach < 0.75 * open_reach).all()


@pytest.mark.parametrize("side", ["left", "right"])
def test_writing_and_reading_give_the_same_rotations(tmp_path: Path, side: str) -> None:
    for skeleton in (hand(side), with_forearm(hand(side)), mano_rig(side, turned(np.array([0.4, 0.9, -0.3])))):
        wanted = postures(skeleton, side, POSTURES)
        write_motion(tmp_path / "out.npz", rig(skeleton), wanted, rate=25.0)
        assert list(tmp_path.iterdir()) == [tmp_path / "out.npz"]
        loaded = load_motion(tmp_path / "out.npz", rig(skeleton))
        assert (loaded.rate, loaded.warnings, loaded.notes) == (25.0, (), ())
        np.testing.assert_allclose(loaded.poses.positions, wanted.positions, atol=1e-9)
        same = np.abs((loaded.poses.rotations * wanted.rotations).sum(axis=-1))
        assert np.degrees(2 * np.arccos(np.clip(same, 0, 1))).max() < 1e-5
        (one,) = read_hands(tmp_path / "out.npz").hands
        assert one.side == side


def test_real_hands_come_back(data: Path, tmp_path: Path) -> None:
    for file in ("hand_anny/left.glb", "hand_webxr_generic/right.glb"):
        driven = load_rig(data / file)
        side = driven.skeleton.names[0].partition(".")[0]
        wanted = postures(driven.skeleton, side, POSTURES)
        write_motion(tmp_path / "out.npz", driven, wanted, rate=30.0)
        got = load_motion(tmp_path / "out.npz", driven).poses
        np.testing.assert_allclose(got.positions, wanted.positions, atol=1e-8)


def test_what_is_written_is_manos(tmp_path: Path) -> None:
    """Read without the reader: forward kinematics of the written numbers give the rig's phalanges."""
    for side in ("left", "right"):
        skeleton = mano_rig(side, TURNS["axes"])
        wanted = postures(skeleton, side, POSTURES)
        write_motion(tmp_path / "out.npz", rig(skeleton), wanted, rate=30.0)
        with np.load(tmp_path / "out.npz", allow_pickle=False) as file:
            fields = {name: file[name] for name in file.files}
        assert fields["hand_pose"].shape == (len(POSTURES), 45)
        assert fields["joint_order"].tolist() == [f"{digit}{k}" for digit in ORDER for k in (1, 2, 3)]
        assert (str(fields["side"]), bool(fields["flat_hand_mean"]), float(fields["fps"])) == (side, True, 30.0)
        np.testing.assert_allclose(fields["transl"], wanted.positions[:, 0])
        for f in range(len(POSTURES)):
            got = directions(side, fields["hand_pose"][f].reshape(15, 3), fields["global_orient"][f])
            np.testing.assert_allclose(got, phalanges(skeleton, wanted.positions)[f], atol=1e-9)
        curl = fields["hand_pose"][POSTURES.index("fist")].reshape(15, 3)[:12, 2]
        assert (np.sign(curl) == (1 if side == "right" else -1)).all()


def test_a_rig_with_two_hands_is_written_with_both(tmp_path: Path) -> None:
    left, right = (mano_rig(side, np.eye(3)) for side in ("left", "right"))
    count = len(left)
    both = Skeleton(
        left.names + right.names,
        np.concatenate([left.parents, np.where(right.parents < 0, -1, right.parents + count)]).astype(np.int32),
        np.vstack([left.rest, right.rest + np.array([0.0, 0.5, 0.0])]),
        np.vstack([left.axes, right.axes]),
        default_limits(left.names + right.names),
    )
    halves = [postures(one, side, POSTURES) for one, side in ((left, "left"), (right, "right"))]
    wanted = Poses(
        np.concatenate([halves[0].positions, halves[1].positions + np.array([0.0, 0.5, 0.0])], axis=1),
        np.concatenate([half.rotations for half in halves], axis=1),
        np.concatenate([half.flexion for half in halves], axis=1),
    )
    write_motion(tmp_path / "out.npz", rig(both), wanted, rate=30.0)
    got = load_motion(tmp_path / "out.npz", rig(both)).poses
    fingers = [j for j, name in enumerate(both.names) if not name.endswith(".wrist")]
    same = np.abs((got.rotations * wanted.rotations).sum(axis=-1))[:, fingers]
    assert np.degrees(2 * np.arccos(np.clip(same, 0, 1))).max() < 1e-4


def test_a_rig_without_hands_is_refused(tmp_path: Path) -> None:
    skeleton = Skeleton(
        ("a", "b"), np.array([-1, 0], dtype=np.int32), np.eye(3)[:2], np.eye(3)[1:], default_limits("ab")
    )
    with pytest.raises(InputError, match="this rig has none"):
        write_motion(tmp_path / "out.npz", rig(skeleton), rest_poses(skeleton), rate=30.0)


def test_ways_of_writing_the_same(tmp_path: Path) -> None:
    skeleton, pose = mano_rig("right", np.eye(3)), random_pose("right", 3)
    flat = pose.reshape(3, 45)
    order = [f"{d}{k}" for d in ("thumb", "index", "middle", "ring", "little") for k in (1, 2, 3)]
    where = [ORDER.index(name[:-1].replace("little", "pinky")) * 3 + int(name[-1]) - 1 for name in order]
    matrices = np.array([[turned(v) for v in frame] for frame in pose])
    mean = np.linspace(-0.1, 0.1, 45)
    said = {"flat_hand_mean": True, "side": "right"}
    contents: list[object] = [
        said | {"hand_pose": flat.tolist()},
        said | {"poses": pose.tolist()},
        said | {"hand_pose": matrices.tolist()},
        said | {"hand_pose": pose[:, where].tolist(), "joint_order": [f"right_{name}" for name in order]},
        {"flat_hand_mean": False, "is_right": 1, "hand_pose": (flat - mean).tolist(), "hands_mean": mean.tolist()},
        {"flat_hand_mean": True, "right": {"pose": flat.tolist()}},
        {"flat_hand_mean": True, "right_hand_pose": flat.tolist()},
        [said | {"hand_pose": row.tolist(), "transl": [0, 0, 0]} for row in flat],
        {"flat_hand_mean": True, "frames": [{"hand_pose": row.tolist(), "handedness": "Right"} for row in flat]},
    ]
    for content in contents:
        loaded = load_motion(save(tmp_path, content), rig(skeleton), rate=30)
        wanted = np.array([directions("right", p, np.zeros(3)) for p in pose])
        np.testing.assert_allclose(phalanges(skeleton, loaded.poses.positions), wanted, atol=1e-9)
    save(tmp_path, flat.tolist(), "bare.json")
    np.save(tmp_path / "bare.npy", flat)
    np.savez(tmp_path / "bare.npz", pose=flat)
    for name in ("bare.json", "bare.npy", "bare.npz"):
        with pytest.raises(
            InputError, match=rf"{name}: does not say whether no rotation means the flat hand.*flat_hand_mean"
        ):
            load_motion(tmp_path / name, rig(skeleton))
        loaded = load_motion(tmp_path / name, rig(skeleton), rate=30, flat_hand_mean=True)
        np.testing.assert_allclose(phalanges(skeleton, loaded.poses.positions), wanted, atol=1e-9)


@pytest.mark.parametrize(("width", "start"), [(156, 66), (165, 75)])
def test_hands_of_whole_bodies_drive_both(data: Path, tmp_path: Path, width: int, start: int) -> None:
    driven = load_rig(data / "body_mesh2motion_mannequin" / "human-male.glb")
    left, right = random_pose("left", 4).reshape(4, 45), random_pose("right", 4, seed=2).reshape(4, 45)
    poses = np.full((4, width), 0.3)
    poses[:, start : start + 45], poses[:, start + 45 : start + 90] = left, right
    np.savez(tmp_path / "body.npz", poses=poses, trans=np.zeros((4, 3)), mocap_framerate=60.0)
    loaded = load_motion(tmp_path / "body.npz", driven, flat_hand_mean=True)
    assert loaded.rate == 60.0
    assert "only its hands are followed" in loaded.warnings[0]
    for side, pose in (("left", left), ("right", right)):
        one = load_motion(
            save(tmp_path, {"side": side, "hand_pose": pose.tolist(), "flat_hand_mean": True, "fps": 60}), driven
        )
        own = [j for j, name in enumerate(driven.skeleton.names) if name.startswith(f"{side}.")]
        np.testing.assert_allclose(loaded.poses.positions[:, own], one.poses.positions[:, own], atol=1e-9)


def test_pickles_are_refused_by_name(tmp_path: Path) -> None:
    with (tmp_path / "mano.pkl").open("wb") as file:
        pickle.dump({"pose": [0.0] * 48}, file)
    (tmp_path / "mano.npy").write_bytes((tmp_path / "mano.pkl").read_bytes())
    np.savez(tmp_path / "mano.npz", pose=np.array([{"a": 1}], dtype=object))
    np.save(tmp_path / "object.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    for name in ("mano.pkl", "mano.npy", "mano.npz", "object.npy"):
        with pytest.raises(InputError, match=rf"{name}: .*pickled Python objects"):
            load_motion(tmp_path / name, rig(hand("left")))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"hand_pose": [[0.0] * 45], "flat_hand_mean": False}, "licensed model: add its 45 numbers as 'hands_mean'"),
        (
            {"hand_pose": [[0.0] * 12], "flat_hand_mean": True},
            "want 45, 48 or 51 numbers a frame.*principal components",
        ),
        ({"hand_pose": [[float("nan")] * 45], "flat_hand_mean": True}, "'hand_pose': not finite in frame 0"),
        ({"hand_pose": [[0.0] * 45], "flat_hand_mean": "yes"}, "flat_hand_mean: want true or false"),
        ({"hand_pose": [[0.0] * 45], "flat_hand_mean": True, "side": "up"}, "'side': want left or right, got 'up'"),
        (
            {"hand_pose": [[0.0] * 45], "flat_hand_mean": True, "joint_order": ["index1"]},
            "joint_order: want the fifteen",
        ),
        (
            {"hand_pose": [[0.0] * 45] * 2, "transl": [[0, 0, 0]], "flat_hand_mean": True},
            "'transl': want 3 numbers in each of 2",
        ),
        (
            {"hand_pose": [[0.0] * 45, [0.0]], "flat_hand_mean": True},
            "'hand_pose': want numbers, as many in every frame",
        ),
    ],
)
def test_mistakes_are_named(tmp_path: Path, content: object, message: str) -> None:
    with pytest.raises(InputError, match=f"hand.json: .*{message}"):
        read_hands(save(tmp_path, content))


def test_rotations_of_the_other_hand_are_refused(tmp_path: Path) -> None:
    fields = {"hand_pose": random_pose("left", 3).reshape(3, 45).tolist(), "flat_hand_mean": True, "side": "right"}
    with pytest.raises(InputError, match="as a right hand its fingers bend backwards"):
        load_motion(save(tmp_path, fields), rig(hand("right")))


def test_files_that_announce_more_than_they_hold_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros((2, 45)))
    lie = (
        (tmp_path / "a.npy")
        .read_bytes()
        .replace(b"(2, 45), }", b"(9999999999, 45), }")
        .replace(b"          \n", b" \n", 1)
    )
    (tmp_path / "a.npy").write_bytes(lie)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as file:
        file.writestr("pose.npy", lie)
    (tmp_path / "b.npz").write_bytes(b"PK no zip")
    for name in ("a.npy", "a.npz", "b.npz", "none.npz"):
        with pytest.raises(InputError, match=name):
            read_hands(tmp_path / name)
