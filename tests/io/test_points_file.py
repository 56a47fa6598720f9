"""Points files: the 87 named points of an actor, or the 25 of a hand (R12)."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.points_file import write_points_file
from warpjld.io.skeleton_file import write_skeleton_file
from warpjld.skeleton.actor import actor_skeleton
from warpjld.skeleton.actor_points import ACTOR_PARENTS, CANONICAL


@pytest.fixture(scope="module")
def files(figure, tmp_path_factory):
    folder = tmp_path_factory.mktemp("points")
    surface = folder / "body.obj"
    trimesh.Trimesh(figure.surface.vertices, figure.surface.faces, process=False).export(surface)
    points = actor_skeleton(figure.skeleton, figure.surface.vertices, figure.surface.faces).points
    write_points_file(folder / "points.json", points)
    return surface, folder / "points.json", points


@pytest.fixture(scope="module")
def rig(files):
    return load_rig(files[0], points=files[1])


def changed(files, tmp_path, change):
    content = json.loads(files[1].read_text())
    change(content["points"])
    path = tmp_path / "changed.json"
    path.write_text(json.dumps(content))
    return path


def test_all_87_are_joints_where_they_were_placed(files, rig):
    points = files[2]
    assert len(rig.skeleton) == 87
    rest = dict(zip(rig.skeleton.names, rig.skeleton.rest, strict=True))
    for name, place in points.items():
        np.testing.assert_allclose(rest[CANONICAL[name]], place, atol=1e-6)
    parents = dict(zip(rig.skeleton.names, rig.skeleton.parents, strict=True))
    for name, above in ACTOR_PARENTS.items():
        parent = int(parents[CANONICAL[name]])
        assert (rig.skeleton.names[parent] if parent >= 0 else None) == (CANONICAL[above] if above else None)
    assert rig.suspicious == ()
    assert list(actor_skeleton(rig.skeleton, rig.surface.vertices, rig.surface.faces).points) == list(points)


def test_points_in_a_surface_that_is_inside_out_are_inside(files, figure, tmp_path):
    """Each of the 87 was said to lie outside."""
    trimesh.Trimesh(figure.surface.vertices, figure.surface.faces[:, ::-1], process=False).export(tmp_path / "out.obj")
    rig = load_rig(tmp_path / "out.obj", points=files[1])
    assert rig.suspicious == ()
    assert "the surface is inside out: its triangles are turned over" in rig.notes


def test_points_of_other_axes_are_told_in_one_line(files, tmp_path):
    def lying(points):
        for name, (x, y, z) in points.items():
            points[name] = [x, -z, y]

    found = load_rig(files[0], points=changed(files, tmp_path, lying)).suspicious
    (line,) = [line for line in found if "outside" in line and "points lie" in line]
    assert "of 87 points lie outside the surface (" in line
    assert "unit and axes of its file" in line


def test_points_near_one_another_are_not_merged(files, tmp_path):
    """Vertebrae 2 mm apart, a carpal end at the wrist, a fingertip outside: they stay where they are."""

    def crowd(points):
        points["vertebra2"] = [x + d for x, d in zip(points["vertebra1"], (0, 0.002, 0), strict=True)]
        points["left.index.carpometacarpal"] = [x + 1e-3 for x in points["left.wrist"]]
        points["right.middle.tip"][1] -= 0.3

    path = changed(files, tmp_path, crowd)
    rig = load_rig(files[0], points=path)
    wanted = json.loads(path.read_text())["points"]
    rest = dict(zip(rig.skeleton.names, rig.skeleton.rest, strict=True))
    for name, place in wanted.items():
        np.testing.assert_allclose(rest[CANONICAL[name]], place, atol=1e-6)
    assert any("right.middle.tip lies outside the surface" in line for line in rig.suspicious)


def test_a_skeleton_file_with_the_87_names_keeps_them_all(files, tmp_path):
    joints = [
        {"name": name, "parent": ACTOR_PARENTS[name], "position": list(map(float, place))}
        for name, place in files[2].items()
    ]
    path = tmp_path / "skeleton.json"
    path.write_text(json.dumps({"joints": joints}))
    rig = load_rig(files[0], skeleton=path)
    assert sorted(rig.skeleton.names) == sorted(CANONICAL.values())


def test_a_written_skeleton_reads_back(files, rig, tmp_path):
    write_skeleton_file(tmp_path / "own.json", rig.skeleton)
    again = load_rig(files[0], skeleton=tmp_path / "own.json")
    assert set(rig.skeleton.names) - set(again.skeleton.names) == set()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda p: p.pop("left.knee"), "86 of 87 points: no left.knee"),
        (lambda p: p.update({"left.kne": [0, 0, 0]}), "no point 'left.kne'.*left.knee"),
        (lambda p: p.update({"chin": [0, 1]}), "point 'chin' wants three finite numbers"),
        (lambda p: p.update({"chin": [0, 1, float("nan")]}), "three finite numbers"),
        (lambda p: p.update({"chin": p["nose_tip"]}), "'chin' and 'nose_tip' lie at the same place"),
    ],
)
def test_wrong_points_are_named(files, tmp_path, change, said):
    with pytest.raises(InputError, match=said):
        load_rig(files[0], points=changed(files, tmp_path, change))


def test_points_and_a_skeleton_are_one_too_many(files):
    with pytest.raises(InputError, match="not both"):
        load_rig(files[0], points=files[1], skeleton=files[1])


def test_a_flexion_axis_along_its_own_segment_is_refused(files, tmp_path):
    joints = [
        {"name": name, "parent": ACTOR_PARENTS[name], "position": list(map(float, place))}
        for name, place in files[2].items()
    ]
    knee = next(joint for joint in joints if joint["name"] == "left.knee")
    knee["axis"] = list(map(float, files[2]["left.ankle"] - files[2]["left.knee"]))
    path = tmp_path / "skeleton.json"
    path.write_text(json.dumps({"joints": joints}))
    with pytest.raises(InputError, match=r"'left.knee': its flexion axis lies along its own segment"):
        load_rig(files[0], skeleton=path)
