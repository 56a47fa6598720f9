"""``warpjld inspect``."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

from warpjld.cli.inspect import inspect_command


def run(*arguments: object):
    result = CliRunner().invoke(inspect_command, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture(scope="module")
def hand(data):
    return data / "hand_anny/left.glb"


def test_the_report_names_joints_domains_limits_and_doubts(hand):
    out = run(hand, "--no-picture").stdout
    assert "left.index.knuckle2" in out
    assert "finger2-2.L" in out
    assert "flexion 0…100°" in out
    assert "note: left hand: recognised by names, 20 of 25 joints in the file" in out
    assert "placing: nothing suspicious" in out


def test_json_holds_the_same(hand, tmp_path):
    report = json.loads(run(hand, "--no-picture", "--json").stdout)
    assert len(report["joints"]) == 25
    joint = next(j for j in report["joints"] if j["name"] == "left.index.knuckle2")
    assert joint["parent"] == "left.index.base"
    assert joint["limits"] == {"flexion": [0.0, 100.0]}
    assert sum(j["domain"] for j in report["joints"]) == report["surface"]["vertices"]
    assert report["placing"] == []
    assert {"left.middle.knuckle2"} <= {f["joint"] for f in report["off centre"]}


def test_quiet_prints_doubts_only(data):
    assert run(data / "hand_webxr_generic/left.glb", "--no-picture", "-q").stdout == ""


def test_the_picture_is_written(hand, tmp_path):
    from PIL import Image

    path = tmp_path / "hand.png"
    assert f"picture: {path}" in run(hand, "-o", path).stdout
    picture = Image.open(path).convert("L")
    drawn = sum(picture.histogram()[:250]) / (picture.width * picture.height)
    assert 0.1 < drawn < 0.9
    assert [p.name for p in tmp_path.iterdir()] == ["hand.png"]


def test_the_skeleton_can_be_written_for_editing(hand, tmp_path):
    run(hand, "--no-picture", "-q", "--write-skeleton", tmp_path / "s.json")
    joints = json.loads((tmp_path / "s.json").read_text())["joints"]
    assert joints[0]["name"] == "left.wrist"
    assert len(joints) == 25


def test_animations_are_listed(tmp_path):
    from tests.motion.skinned_files import animal, write

    times, turns = np.array([0.0, 1.0]), np.tile(animal().turns[1], (2, 1))
    still = {(1, "rotation"): (times, turns, "LINEAR")}
    path = write(tmp_path / "a.glb", animal(), {"Idle": still, "Walk": still})
    assert "animations: Idle, Walk" in run(path, "--no-picture").stdout
    assert json.loads(run(path, "--no-picture", "--json").stdout)["animations"] == ["Idle", "Walk"]


def test_joints_off_their_flesh_are_told_and_moved_on_request(tmp_path):
    import trimesh

    from warpjld.io.skeleton_file import write_skeleton_file
    from warpjld.skeleton import Skeleton, default_limits

    names = tuple(f"left.index.{part}" for part in ("base", "knuckle2", "knuckle3", "tip"))
    rest = np.array([[0, 0, 0], [0, 0, -0.03], [0, 0.004, -0.06], [0, 0, -0.085]])
    axes = np.tile([-1.0, 0, 0], (4, 1))
    parents = np.array([-1, 0, 1, 2], dtype=np.int32)
    write_skeleton_file(tmp_path / "joints.json", Skeleton(names, parents, rest, axes, default_limits(names)))
    pipe = trimesh.creation.cylinder(radius=0.008, height=0.1, sections=32)
    pipe = pipe.subdivide_to_size(0.012)
    pipe.apply_translation([0, 0, -0.042])
    pipe.export(tmp_path / "finger.ply")
    arguments = (tmp_path / "finger.ply", "--skeleton", tmp_path / "joints.json", "--unit", "m", "--no-picture")
    told = run(*arguments).output
    found = re.search(r"left.index.knuckle3 lies (\S+) mm off the middle of its flesh, which is (\S+) mm thick", told)
    assert found, told
    assert [float(x) for x in found.groups()] == pytest.approx([4.0, 16.0], abs=0.15)
    moved = run(*arguments, "--centre-joints").output
    assert "off the middle" not in moved
    assert re.search(r"left.index.knuckle3 is moved by (3.9|4.0) mm to the middle of its flesh", moved)
