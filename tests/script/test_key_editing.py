"""Keys as a whole, and whole poses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.script.pose_files import SHIPPED, hand_channels, load_pose, save_pose, shipped_pose

INDEX, WRIST = "left.index.base.flexion", "left.wrist.flexion"
SET = "JOINT left.index.base FLEXION AT 0 10\nJOINT left.wrist FLEXION AT 0 20\nMOVE left 0 1 2 3\n"


def keys(scene: Scene, channel: str) -> dict[float, float]:
    track = scene.actors["LEFT"].motion.tracks.get(channel)
    return {} if track is None else {key.frame: round(float(np.degrees(key.value)), 6) for key in track.keys}


def moved(scene: Scene) -> list[float]:
    return scene.actors["LEFT"].placement.tracks["move.y"].spline(np.array([7.0])).tolist()


def test_keys_of_all_channels_move(run) -> None:
    scene = run(f"{SET}JOINT left.index.base FLEXION AT 3 30\nKEYS MOVE 0 7")
    assert keys(scene, INDEX) == {3: 30, 7: 10}
    assert keys(scene, WRIST) == {7: 20}
    assert moved(scene) == [2]


def test_keys_are_copied_over_those_that_are_there_and_forgotten(run) -> None:
    scene = run(f"{SET}JOINT left.index.base FLEXION AT 7 30\nKEYS COPY 0 7 LEFT")
    assert keys(scene, INDEX) == {0: 10, 7: 10}
    run("KEYS DELETE 0")
    assert keys(scene, WRIST) == {7: 20}
    run("KEYS DELETE 7")
    assert scene.actors["LEFT"].key_frames == []
    assert not scene.actors["LEFT"].keyed


def test_keys_get_other_spline_constants(run) -> None:
    scene = run(f"{SET}KEYS SPLINE 0 1 -0.5 0.25")
    (key,) = scene.actors["LEFT"].motion.tracks[INDEX].keys
    assert (key.tension, key.continuity, key.bias) == (1, -0.5, 0.25)


def test_a_frame_without_keys_is_named(run) -> None:
    with pytest.raises(InputError, match="LEFT has no key at 5"):
        run(f"{SET}KEYS DELETE 5")


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_poses_lie_within_the_built_in_hands_limits(scene: Scene, name: str) -> None:
    limits = hand_channels(scene.actors["LEFT"], "left")
    for channel, degrees in shipped_pose(name).items():
        low, high = limits[channel]
        assert low - 1e-9 <= degrees <= high + 1e-9, channel


def test_a_pose_keys_every_channel_of_the_digits_and_not_the_wrist(run) -> None:
    scene = run("JOINT left.index.base ABDUCTION AT 5 12\nPOSE LEFT FIST 5")
    assert keys(scene, INDEX) == {5: shipped_pose("fist")["index.base.flexion"]}
    assert keys(scene, "left.index.base.abduction") == {5: 0}
    assert keys(scene, WRIST) == {}
    assert set(scene.actors["LEFT"].motion.tracks) == {f"left.{c}" for c in hand_channels(scene.actors["LEFT"], "left")}


def test_a_share_of_a_pose_lies_between_where_the_digits_are_and_it(run) -> None:
    scene = run("JOINT left.index.base FLEXION AT 0 20\nPOSE LEFT FIST 0 SHARE 25")
    wanted = shipped_pose("fist")["index.base.flexion"]
    assert keys(scene, INDEX)[0] == pytest.approx(20 + 0.25 * (wanted - 20))


def test_a_pose_from_a_file_on_the_other_hand_is_the_mirrored_one(hands, tmp_path: Path) -> None:
    angles = {"index.base.flexion": 31.0, "thumb.base.pivot": 12.25, "ring.base.abduction": -7.5}
    save_pose(tmp_path / "own.json", angles)
    assert load_pose(tmp_path / "own.json") == angles
    (tmp_path / "a.jld").write_text('POSE LEFT "own.json" 0\nPOSE RIGHT "own.json" 0\n')
    scene = Scene()
    for side in ("left", "right"):
        scene.add(side, hands[side])
    Interpreter(scene).run_file(tmp_path / "a.jld")
    left, right = (scene.actors[side].motion.poses(scene.actors[side].skeleton, [0.0]) for side in ("LEFT", "RIGHT"))
    rests = [scene.actors[side].skeleton.rest for side in ("LEFT", "RIGHT")]
    mirror = np.sign((rests[0] * rests[1]).sum(axis=0))  # the axis along which the two hands mirror each other
    assert np.allclose(left.positions[0] * mirror, right.positions[0], atol=1e-9)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("{", "no pose"),
        ("[]", 'want {"angles"'),
        ('{"angles": {"wrist.flexion": 1}}', "want digit.joint.angle"),
        ('{"angles": {"index.base.bend": 1}}', "want digit.joint.angle"),
        ('{"angles": {"index.base.flexion": "1"}}', "want a number of degrees"),
        ('{"angles": {"index.base.flexion": NaN}}', "want a number of degrees"),
        ('{"angles": {"index.base.flexion": true}}', "want a number of degrees"),
    ],
)
def test_files_that_hold_no_pose_are_named(tmp_path: Path, content: str, says: str) -> None:
    (tmp_path / "bad.json").write_text(content)
    with pytest.raises(InputError) as caught:
        load_pose(tmp_path / "bad.json")
    assert says in str(caught.value)
    assert "bad.json" in str(caught.value)


def test_a_pose_file_is_plain_json(tmp_path: Path) -> None:
    save_pose(tmp_path / "flat.json", {"index.base.flexion": 0.0})
    assert json.loads((tmp_path / "flat.json").read_text()) == {"pose": "flat", "angles": {}}
