"""Grasps of others: read in their own kinds, refused by name where they are no grasps of this hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.study.scoring.given import GivenGrasp
from warpjld.study.scoring.joint_names import JointNames, read_joint_names
from warpjld.study.scoring.read import read_grasps
from warpjld.study.scoring.reading_grasps import GraspReading
from warpjld.study.scoring.score import given_scores, hand_choice
from warpjld.study.scoring.things import ObjectFolder

_YAML = """format: isaac_grasp
format_version: 1.0
object_frame_link: /World/mug
gripper_frame_link: /World/hand
grasps:
  "grasp_0":
    confidence: 1.0
    position: [0.01, 0.02, 1e-3]
    orientation: {w: 0.70710678, xyz: [0.0, 0.70710678, 0.0]}
    cspace_position:
      JOINT: 0.5
    pregrasp_cspace_position:
      JOINT: 0.0
"""


@pytest.fixture(scope="module")
def rig() -> Rig:
    from warpjld.hand.kept import kept_hand

    return kept_hand("right", resolution=1500)


def how(rig: Rig, **more: Any) -> GraspReading:
    return GraspReading(lambda name: rig, **more)


def write(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_isaac_grasps(rig: Rig, tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    path = write(tmp_path, "a.yaml", _YAML.replace("JOINT", "index.base.flexion"))
    (grasp,) = read_grasps(path, how(rig))
    assert (grasp.name, grasp.thing) == ("grasp_0", "mug")
    skeleton = rig.skeleton
    np.testing.assert_allclose(skeleton.rest[0] + grasp.position, [0.01, 0.02, 0.001], atol=1e-15)
    np.testing.assert_allclose(grasp.rotation, [0, np.sqrt(0.5), 0, np.sqrt(0.5)], atol=1e-8)
    assert grasp.angles is not None
    assert grasp.angles[skeleton.index("index.base"), 0] == 0.5
    assert np.count_nonzero(grasp.angles != skeleton.initial) == 1


def test_a_robots_joints_are_refused_by_name(rig: Rig, tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    path = write(tmp_path, "a.yaml", _YAML.replace("JOINT", "panda_finger_joint1"))
    with pytest.raises(InputError, match=r"a.yaml: grasp_0: 'panda_finger_joint1': no joint of this hand.*joint map"):
        read_grasps(path, how(rig))


def test_a_joint_map_says_what_they_are(rig: Rig, tmp_path: Path) -> None:
    said = {"joints": {"J1": {"channel": "index.base.abduction", "factor": -1, "offset": 5}, "J2": "thumb.base.flexion",
                       "J0": None},
            "order": ["J0", "J1", "J2"],
            "hand_frame": {"position": [0, 0, 0.1], "rotation": [0, 1, 0, 0]}}  # fmt: skip
    names = read_joint_names(write(tmp_path, "map.json", json.dumps(said)))
    turn = Rotation.from_euler("y", 90, degrees=True)
    w = turn.as_quat()[[3, 0, 1, 2]]
    qpos = np.array([[0.1, 0.2, 0.3, *w, 9.0, 0.1, 0.2], [0.0, 0.0, 0.0, *w, 9.0, 0.0, 0.3]])
    content = {"grasp_qpos": qpos, "obj_pose": np.array([0, 0, 1, 1, 0, 0, 0.0]), "obj_scale": np.array([0.1, 0.2]),
               "obj_path": "assets/bottle"}  # fmt: skip
    np.save(tmp_path / "g.npy", np.array(content, dtype=object))
    first, second = read_grasps(tmp_path / "g.npy", how(rig, names=names))
    assert (first.scale, second.scale, second.name) == (0.1, 0.2, "g#1")
    skeleton = rig.skeleton
    assert first.angles is not None
    assert first.angles[skeleton.index("index.base"), 3] == pytest.approx(np.radians(5.0) - 0.1)
    assert first.angles[skeleton.index("thumb.base"), 0] == pytest.approx(0.2)
    # the rig's frame lies 0.1 m along the z axis of theirs, which points along the world's x, turned half round its x
    np.testing.assert_allclose(skeleton.rest[0] + first.position, [0.2, 0.2, 0.3], atol=1e-12)
    wanted = turn * Rotation.from_euler("x", 180, degrees=True)
    assert (Rotation.from_quat(first.rotation) * wanted.inv()).magnitude() < 1e-9
    with pytest.raises(InputError, match=r"g.npy: has 3 joints without names: state their order"):
        read_grasps(tmp_path / "g.npy", how(rig))
    with pytest.raises(InputError, match="has 3 joints, and 2 names"):
        read_grasps(tmp_path / "g.npy", how(rig, names=JointNames(order=("a", "b"))))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([], r"map.json: want"),
        ({"joints": {"a": 3}}, r"map.json: joints.a: want null"),
        ({"joints": {"a": {"channel": "x", "sign": 1}}}, r"joints.a: there is no 'sign'"),
        ({"joints": {}, "hand_frame": {"rotation": [0, 0, 0, 0]}}, r"hand_frame.rotation: has no length"),
        ({"joints": {}, "order": [1]}, r"order: want a list of names"),
    ],
)
def test_joint_maps_with_mistakes(tmp_path: Path, content: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_joint_names(write(tmp_path, "map.json", json.dumps(content)))


def test_rows_of_a_csv_are_degrees(rig: Rig, tmp_path: Path) -> None:
    head = "object,x,y,z,qw,qx,qy,qz,index.base.flexion,left.thumb.base.flexion"
    path = write(tmp_path, "g.csv", f"{head.replace('left.', '')},scale\nball,0,0,0.1,1,0,0,0,90,,2\n")
    (grasp,) = read_grasps(path, how(rig))
    assert grasp.angles is not None
    assert grasp.angles[rig.skeleton.index("index.base"), 0] == pytest.approx(np.pi / 2)
    assert (grasp.name, grasp.thing, grasp.scale) == ("line 2", "ball", 2.0)
    with pytest.raises(InputError, match=r"g.csv:2: line 2: 'left.thumb.base.flexion': no joint of this hand"):
        read_grasps(write(tmp_path, "g.csv", f"{head}\nball,0,0,0,1,0,0,0,9,9\n"), how(rig))
    with pytest.raises(InputError, match=r"g.csv:2: .*unit quaternion"):
        read_grasps(write(tmp_path, "g.csv", f"{head}\nball,0,0,0,1,1,0,0,9,\n"), how(rig))
    with pytest.raises(InputError, match=r"g.csv:1: has no column qz"):
        read_grasps(write(tmp_path, "g.csv", "object,x,y,z,qw,qx,qy\nball,0,0,0,1,0,0\n"), how(rig))


def test_angles_in_degrees_where_radians_are_wanted(rig: Rig, tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    path = write(tmp_path, "a.yaml", _YAML.replace("JOINT: 0.5", "index.base.flexion: 45.0"))
    with pytest.raises(InputError, match=r"grasp_0: 'index.base.flexion': 45 is no angle in radians \(degrees\?\)"):
        read_grasps(path, how(rig))


def _recording(frames: int = 3) -> dict[str, Any]:
    turn = np.array([0.3, -0.5, 0.2])
    hand = {
        "trans": np.tile([0.1, 0.2, 0.3], (frames, 1)),
        "rot": np.tile(turn, (frames, 1)),
        "pose": np.zeros((frames, 45)),
    }
    thing = {
        "trans": np.full((frames, 3), 0.5),
        "rot": np.tile([0.0, 0.0, np.pi / 2], (frames, 1)),
        "angle": np.zeros(frames),
    }
    return {"right_hand": hand, "abc": thing}


def test_recordings_of_mano_hands(rig: Rig, tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.array(_recording(), dtype=object))
    (grasp,) = read_grasps(tmp_path / "m.npy", how(rig, flat_hand_mean=True))
    assert (grasp.name, grasp.thing, grasp.message) == ("m#2", "abc", "frame 2 of 3, the last")
    assert len(read_grasps(tmp_path / "m.npy", how(rig, flat_hand_mean=True, frames="all"))) == 3
    poses = grasp.poses(rig.skeleton)
    assert poses is not None
    wrist, knuckle = (poses.positions[0, rig.skeleton.index(name)] for name in ("wrist", "middle.base"))
    np.testing.assert_allclose(wrist, [0.1, 0.2, 0.3], atol=1e-9)
    # MANO's right fingers point along -x at rest
    along = Rotation.from_rotvec([0.3, -0.5, 0.2]).apply([-1.0, 0.0, 0.0])
    assert along @ (knuckle - wrist) / np.linalg.norm(knuckle - wrist) > np.cos(np.radians(5.0))
    np.testing.assert_allclose(grasp.place.to_local(np.array([[0.5, 0.6, 0.5]]))[0, 0], [0.1, 0, 0], atol=1e-12)
    with pytest.raises(InputError, match=r"m.npy: .*flat_hand_mean"):
        read_grasps(tmp_path / "m.npy", how(rig))


def test_recordings_that_cannot_be(rig: Rig, tmp_path: Path) -> None:
    for change, message in (
        ({"right_hand": None, "left_hand": _recording()["right_hand"]}, "has no right_hand"),
        ({"abc": None}, "want one object beside the hand, got none"),
        ({"abc": _recording(2)["abc"]}, "want as many frames as the hand has, 3"),
    ):
        content = {key: value for key, value in (_recording() | change).items() if value is not None}
        np.save(tmp_path / "m.npy", np.array(content, dtype=object))
        with pytest.raises(InputError, match=rf"m.npy: .*{message}"):
            read_grasps(tmp_path / "m.npy", how(rig, flat_hand_mean=True))


def test_a_skin_is_the_rigs(rig: Rig, tmp_path: Path) -> None:
    listed = {"format": "warpjld_grasp_meshes", "format_version": 1,
              "grasps": [{"name": "a", "object": "ball", "skin": "a.obj"}]}  # fmt: skip
    path = write(tmp_path, "grasps.json", json.dumps(listed))
    write(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(
        InputError, match=rf"a.obj: is not this hand's skin: want its {len(rig.surface.vertices)} vertices"
    ):
        read_grasps(path, how(rig))
    path = write(tmp_path, "grasps.json", json.dumps(listed).replace("a.obj", "../a.obj"))
    with pytest.raises(InputError, match="lies outside of the folder"):
        read_grasps(path, how(rig))


def test_objects_are_found_as_collections_keep_them(tmp_path: Path) -> None:
    for name in ("ball.obj", "DGN/core_bottle/mesh/simplified.obj", "DGN/core_bottle/mesh/raw.obj", "DGN/cup/cup.ply"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    folder = ObjectFolder(tmp_path)
    assert folder.find("objects/ball.obj") == tmp_path / "ball.obj"
    assert folder.find("assets/DGN/core_bottle") == tmp_path / "DGN/core_bottle/mesh/simplified.obj"
    assert folder.find("cup") == tmp_path / "DGN/cup/cup.ply"
    with pytest.raises(InputError, match=r"no object 'bal' in .*; did you mean ball\?"):
        folder.find("bal")
    with pytest.raises(InputError, match="object 'DGN' may be any of"):
        folder.find("DGN")


def test_hands_are_named_as_on_the_command_line(tmp_path: Path) -> None:
    assert hand_choice("builtin:left").side == "left"
    with pytest.raises(InputError, match=r"want builtin:left or builtin:right"):
        hand_choice("builtin:body")
    with pytest.raises(InputError, match=r"none\.glb: no such file"):
        hand_choice(str(tmp_path / "none.glb"))
    with pytest.raises(InputError, match="want a hand and a folder of objects, or a study's plan"):
        given_scores(tmp_path, hand=hand_choice("builtin:left"))


def test_two_hands_are_not_one(rig: Rig) -> None:
    from warpjld.study.scoring.score import _Hands

    hands = _Hands((hand_choice("builtin:left"),))
    with pytest.raises(InputError, match="grasps of several hands, a, b, but one hand is given"):
        hands.check([GivenGrasp("1", "ball", hand="a"), GivenGrasp("2", "ball", hand="b")])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"obj_scale": "large"}, "obj_scale: want a number, got 'large'"),
        ({"obj_scale": -1.0}, "obj_scale: want a number above 0"),
        ({"obj_pose": [1.0, 2.0]}, r"obj_pose: want 7 numbers, or rows of them, got shape \(2,\)"),
        ({"obj_path": 3}, "obj_path: want the object's file"),
        ({"joint_names": 5}, "joint_names: want a list of names"),
        ({"joint_names": ["index.base.flexion", "index.base.flexion"]}, "two joints are called 'index.base.flexion'"),
        ({"joint_names": ["index.base.flexion", "rh_FFJ2"]}, "'rh_FFJ2': no joint of this hand"),
        ({"grasp_qpos": np.r_[0, 0, 0, 2.0, 0, 0, 0, 0.1, 0.2]}, "unit quaternion w, x, y, z"),
        ({"grasp_qpos": np.r_[0, 0, np.nan, 1.0, 0, 0, 0, 0.1, 0.2]}, "grasp_qpos: holds numbers that are not finite"),
        ({"friction": 0.0}, "friction: want a number above 0"),
    ],
)
def test_dictionaries_with_mistakes(rig: Rig, tmp_path: Path, change: dict[str, Any], message: str) -> None:
    good = {"grasp_qpos": np.r_[0, 0, 0, 1.0, 0, 0, 0, 0.1, 0.2], "obj_path": "ball",
            "joint_names": ["index.base.flexion", "thumb.base.flexion"]}  # fmt: skip
    np.save(tmp_path / "g.npy", np.array(good, dtype=object))
    assert len(read_grasps(tmp_path / "g.npy", how(rig))) == 1
    np.save(tmp_path / "g.npy", np.array(good | change, dtype=object))
    with pytest.raises(InputError, match=f"g.npy: .*{message}"):
        read_grasps(tmp_path / "g.npy", how(rig))


_V1 = "format: isaac_grasp\nformat_version: 1.0\n"


@pytest.mark.parametrize(
    "text", ["", "a: [", _V1.replace("1.0", "2.0") + "grasps: {a: 1}", "- 1", _V1 + "grasps: {a: {position: [1, 2]}}"]
)
def test_yaml_with_mistakes(rig: Rig, tmp_path: Path, text: str) -> None:
    pytest.importorskip("yaml")
    with pytest.raises(InputError, match=r"a\.yaml"):
        read_grasps(write(tmp_path, "a.yaml", text), how(rig))


@pytest.mark.parametrize("table", ["trial,object,scale,friction,mass\nx,ball,1,1,1\n", "trial\n1\n", "\0"])
def test_tables_with_mistakes(rig: Rig, tmp_path: Path, table: str) -> None:
    write(tmp_path, "table.csv", table)
    np.savez(tmp_path / "poses.npz", **{"hand/angles": np.zeros((1, 2, 4))})
    with pytest.raises(InputError, match=r"table\.csv|poses\.npz"):
        read_grasps(tmp_path, how(rig))
