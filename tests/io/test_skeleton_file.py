"""Surfaces of any kind with a skeleton file."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.skeleton_file import write_skeleton_file
from warpjld.skeleton import CHANNELS

ARM = {
    "joints": [
        {"name": "left.shoulder", "parent": None, "position": [0, 0, 0], "axis": [1, 0, 0]},
        {"name": "left.elbow", "parent": "left.shoulder", "position": [0, 0, 0.3], "limits": {"flexion": [0, 140]}},
        {"name": "left.wrist", "parent": "left.elbow", "position": [0, 0, 0.55]},
    ]
}


@pytest.fixture
def tube(tmp_path):
    path = tmp_path / "tube.stl"
    mesh = trimesh.creation.cylinder(0.04, segment=[[0, 0, -0.02], [0, 0, 0.6]])
    mesh.export(path)
    return path


def write(tmp_path, content):
    path = tmp_path / "arm.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_an_arm_from_an_stl(tmp_path, tube):
    rig = load_rig(tube, skeleton=write(tmp_path, ARM), unit="m")
    s = rig.skeleton
    assert s.names[:3] == ("left.shoulder", "left.elbow", "left.wrist")
    np.testing.assert_allclose(s.rest[:3, 2], [0, 0.3, 0.55])
    np.testing.assert_allclose(s.axes[0], [1, 0, 0])
    np.testing.assert_allclose(np.degrees(s.limits[1, CHANNELS.index("flexion")]), [0, 140])
    assert rig.skin is None
    edges = np.sort(rig.surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all(), "an STL's triangles are welded"
    assert s.names[3] == "left.hand.tip"


def test_initial_angles(tmp_path, tube):
    """Stated ones, and those of an elbow that is bent where none is stated (R25)."""
    shoulder, elbow, wrist = ARM["joints"]
    bent = {"joints": [shoulder, elbow | {"axis": [-1, 0, 0]}, wrist | {"position": [0, 0.15, 0.5]}]}
    rig = load_rig(tube, skeleton=write(tmp_path, bent), unit="m")
    assert np.degrees(rig.skeleton.initial[1, 0]) == pytest.approx(np.degrees(np.arctan2(0.15, 0.2)), abs=1e-6)
    assert any(note.startswith("bent at rest: left.elbow by 36.9°") for note in rig.notes)
    bent["joints"][1] = bent["joints"][1] | {"initial": {"flexion": 30, "twisting": -5}}
    rig = load_rig(tube, skeleton=write(tmp_path, bent), unit="m")
    np.testing.assert_allclose(np.degrees(rig.skeleton.initial[1]), [30, 0, -5, 0])
    write_skeleton_file(tmp_path / "again.json", rig.skeleton)
    again = load_rig(tube, skeleton=tmp_path / "again.json", unit="m")
    np.testing.assert_allclose(again.skeleton.initial, rig.skeleton.initial, atol=1e-7)


@pytest.mark.parametrize(
    ("initial", "says"),
    [
        (30, "joint 'left.elbow': initial wants"),
        ({"flexon": 30}, "did you mean flexion"),
        ({"flexion": "30"}, "joint 'left.elbow': initial flexion wants degrees"),
        ({"flexion": 150}, "initial flexion 150° is beyond its limits, 0° to 140°"),
    ],
)
def test_initial_angles_that_are_none(tmp_path, tube, initial, says):
    content = {
        "joints": [joint | ({"initial": initial} if "elbow" in joint["name"] else {}) for joint in ARM["joints"]]
    }
    with pytest.raises(InputError, match=says) as caught:
        load_rig(tube, skeleton=write(tmp_path, content), unit="m")
    assert caught.value.path is not None


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "off", "glb"])
def test_the_built_in_hand_survives_every_surface_format(tmp_path, hands, suffix):
    rig = hands["right"]
    surface, joints = tmp_path / f"hand.{suffix}", tmp_path / "hand.json"
    trimesh.Trimesh(rig.surface.vertices, rig.surface.faces, process=False).export(surface)
    write_skeleton_file(joints, rig.skeleton)
    read = load_rig(surface, skeleton=joints)
    assert read.skeleton.names == rig.skeleton.names
    np.testing.assert_array_equal(read.skeleton.parents, rig.skeleton.parents)
    np.testing.assert_allclose(read.skeleton.rest, rig.skeleton.rest, atol=1e-6)
    np.testing.assert_allclose(read.skeleton.axes, rig.skeleton.axes, atol=1e-6)
    np.testing.assert_allclose(read.skeleton.limits, rig.skeleton.limits, atol=1e-4)
    assert read.skeleton.palms == rig.skeleton.palms
    assert len(read.surface.vertices) == len(rig.surface.vertices)
    assert np.ptp(read.surface.vertices, axis=0) == pytest.approx(np.ptp(rig.surface.vertices, axis=0), abs=1e-5)


@pytest.mark.parametrize("name", ["hand_anny/left.glb", "body_anny/body_lowpoly_163joints.glb"])
def test_a_real_rigs_skeleton_survives_its_file(data, tmp_path, name):
    rig = load_rig(data / name)
    write_skeleton_file(tmp_path / "s.json", rig.skeleton)
    trimesh.Trimesh(rig.surface.vertices, rig.surface.faces, process=False).export(tmp_path / "s.ply")
    read = load_rig(tmp_path / "s.ply", skeleton=tmp_path / "s.json").skeleton
    order = [read.names.index(n) for n in rig.skeleton.names]
    assert len(read) == len(rig.skeleton)
    np.testing.assert_allclose(read.rest[order], rig.skeleton.rest, atol=1e-6)
    np.testing.assert_allclose(read.axes[order], rig.skeleton.axes, atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("{", "is not JSON"),
        ("[]", "want .*joints"),
        ({"joints": [{"parent": None}]}, "joint 0 has no name"),
        ({"joints": [{"name": "a", "position": [0, 0]}]}, "joint 'a': position wants three finite numbers"),
        ({"joints": [{"name": "a", "position": [0, 0, float("nan")]}]}, "joint 'a': position wants three finite"),
        ({"joints": [{"name": "a", "positon": [0, 0, 0]}]}, "no key 'positon'; did you mean position"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "parent": "b"}]}, "no joint 'b' to be its parent"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "parent": "a"}]}, "'a' is its own ancestor"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "axis": [0, 0, 0]}]}, "axis has no length"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "limits": {"flex": [0, 1]}}]}, "did you mean flexion"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "limits": {"flexion": [2, 1]}}]}, "want .smallest, largest"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "limits": {"flexion": [0, 9**99]}}]}, "−360 to 360"),
        ({"joints": [{"name": "a", "position": [0, 0, 0], "limits": {"flexion": [0, 9**999]}}]}, "−360 to 360"),
        ({"joints": [{"name": "a", "position": [0, 0, 0]}] * 2}, "two joints are called 'a'"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, tube, change, message):
    with pytest.raises(InputError, match=message):
        load_rig(tube, skeleton=write(tmp_path, change))


def test_a_surface_without_joints_asks_for_them(tube):
    with pytest.raises(InputError, match="give a skeleton file"):
        load_rig(tube)


def test_a_broken_surface_is_named(tmp_path):
    bad = tmp_path / "bad.obj"
    bad.write_text("v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match=r"bad\.obj"):
        load_rig(bad, skeleton=write(tmp_path, ARM))
    unknown = tmp_path / "bad.xyzzy"
    unknown.write_text("")
    with pytest.raises(InputError, match="not a kind of surface file"):
        load_rig(unknown, skeleton=write(tmp_path, ARM))
    empty = tmp_path / "empty.obj"
    empty.write_text("v 0 0 0\n")
    with pytest.raises(InputError, match=r"empty\.obj"):
        load_rig(empty, skeleton=write(tmp_path, ARM))
