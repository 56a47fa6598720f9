"""Grasps go out to other programs and come back: every way the table's columns are the same."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.segments import SEGMENTS
from warpjld.io.mesh_file import read_mesh
from warpjld.study.arrays import gathered, write_arrays
from warpjld.study.columns import COMMON_COLUMNS
from warpjld.study.grasping import Study
from warpjld.study.grasping.columns import SCORE_COLUMNS
from warpjld.study.pool import perform
from warpjld.study.run import opened, table_columns
from warpjld.study.scoring import given_scores
from warpjld.study.shards import Shard, Shards
from warpjld.tables.files import write_table_csv

_PLAN = """seed = 5
trials = 4
friction = 0.7
scales = [1.0, 1.1]
[[hands]]
name = "hand"
builtin = "right"
resolution = 1500
[[objects]]
builtin = "ball"
[[objects]]
builtin = "box"
mass = 0.2
[measuring]
contact = 0.0006
"""
_KINDS = ("isaac", "dexgraspbench", "mesh")


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("exported") / "study.toml"
    path.write_text(_PLAN)
    return path


@pytest.fixture(scope="module")
def rows(plan: Path) -> dict[int, dict[str, Any]]:
    """The study, run here, and exported."""
    return _run_here(plan)


def _run_here(plan: Path) -> dict[int, dict[str, Any]]:
    study, out = Study.load(plan), plan.parent / "out"
    shards = opened(study.experiment, out)
    for trial in range(study.plan.trials):
        row, outcome = perform(study.experiment, trial)
        shards.write(Shard(trial, row, dict(outcome.arrays), 0.0))
    rows, arrays = gathered(shards.all(study.plan.trials))
    write_table_csv(out / "table.csv", rows, table_columns(study.experiment))
    write_arrays(out / "poses.npz", arrays)
    study.export(out, _KINDS)
    kept = Shards(out / "trials")
    return {trial: shard.row for trial in range(study.plan.trials) if (shard := kept.read(trial)) is not None}


_WAYS = [("", "plan"), ("export/isaac", "folder"), ("export/dexgraspbench", "plan"), ("export/mesh", "folder")]


@pytest.mark.parametrize(("source", "by"), _WAYS)
def test_the_round_trip_gives_the_same_columns(
    plan: Path, rows: dict[int, dict[str, Any]], source: str, by: str
) -> None:
    _same_columns(plan, rows, source, by)


@pytest.mark.slow
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_round_trip_of_a_hand_from_a_file(data: Path, tmp_path: Path, side: str) -> None:
    """Its joints are called otherwise, and its frames differ from those of the built-in hand."""
    file = data / "hand_webxr_generic" / f"{side}.glb"
    path = tmp_path / "study.toml"
    path.write_text(_PLAN.replace('builtin = "right"\nresolution = 1500', f'file = "{file.as_posix()}"'))
    rows = _run_here(path)
    for source, by in _WAYS:
        _same_columns(path, rows, source, by)


def _same_columns(plan: Path, rows: dict[int, dict[str, Any]], source: str, by: str) -> None:
    out = plan.parent / "out"
    study = Study.load(plan)
    how: dict[str, Any] = {"plan": plan} if by == "plan" else {
        "hand": study.plan.hands[0], "objects": out / "export" / "objects", "measuring": study.plan.measuring
    }  # fmt: skip
    experiment = given_scores(out / source, **how)
    assert experiment.trials == sum(row["status"] == "closed" for row in rows.values()) >= 3
    compared = 0
    for k in range(experiment.trials):
        row, _ = perform(experiment, k)
        trial = int(Path(row["grasp"]).stem.replace("_", " ").split()[1])
        for column in SCORE_COLUMNS[1:]:
            mine, theirs = row[column.name], rows[trial][column.name]
            if source.endswith("mesh") and column.name.startswith("wrist"):
                assert mine is None  # a skin does not say where joints are
            elif column.kind == "number" and theirs is not None:
                assert mine == pytest.approx(theirs, rel=1e-6, abs=1e-15), column.name
                compared += 1
            else:
                assert mine == theirs, column.name
    assert compared > 15 * experiment.trials
    assert row["contacts"] > 0


def test_the_scores_are_a_study_too(plan: Path, rows: dict[int, dict[str, Any]], tmp_path: Path) -> None:
    experiment = given_scores(plan.parent / "out" / "export" / "isaac", plan=plan)
    row, _ = perform(experiment, 0)
    assert list(row) == [column.name for column in (*COMMON_COLUMNS, *SCORE_COLUMNS)]
    assert row["status"] == "scored"


def test_joints_frames_and_units_are_in_the_header(plan: Path, rows: dict[int, dict[str, Any]]) -> None:
    yaml = pytest.importorskip("yaml")
    folder = plan.parent / "out" / "export"
    files = sorted((folder / "isaac").glob("*.yaml"))
    assert [file.name for file in files] == ["hand ball 1.1.yaml", "hand ball 1.yaml", "hand box 1.1.yaml",
                                             "hand box 1.yaml"][: len(files)]  # fmt: skip
    content = yaml.safe_load(files[0].read_text("utf-8"))
    assert (content["format"], content["format_version"]) == ("isaac_grasp", 1.0)
    (grasp,) = content["grasps"].values()
    assert list(grasp["cspace_position"]) == content["warpjld"]["joints"]
    assert all(isinstance(value, float) for value in grasp["cspace_position"].values())
    assert "metres and radians" in files[0].read_text("utf-8")
    raw = np.load(next((folder / "dexgraspbench").rglob("*.npy")), allow_pickle=True).item()
    assert raw["grasp_qpos"].shape == (7 + len(raw["joint_names"]),)
    assert np.linalg.norm(raw["grasp_qpos"][3:7]) == pytest.approx(1.0)


def test_contact_maps_agree_with_the_surfaces(plan: Path, rows: dict[int, dict[str, Any]]) -> None:
    import trimesh

    folder = next(folder for folder in sorted((plan.parent / "out" / "export" / "mesh").iterdir()) if folder.is_dir())
    skin, body = read_mesh(folder / "hand.obj"), read_mesh(folder / "object.obj")
    with np.load(folder / "contact.npz") as found:
        near = np.flatnonzero(found["skin_contact"])
        assert len(near) > 0
        thing = trimesh.Trimesh(body.vertices, body.faces, process=False)
        _, distance, _ = trimesh.proximity.closest_point(thing, skin.vertices[near])
        np.testing.assert_allclose(np.abs(found["skin_distance"][near]), distance, atol=2e-7)
        hit = np.flatnonzero(found["object_contact"])
        hull = trimesh.Trimesh(skin.vertices, skin.faces, process=False)
        _, distance, triangle = trimesh.proximity.closest_point(hull, body.vertices[hit])
        np.testing.assert_allclose(np.abs(found["object_distance"][hit]), distance, atol=2e-6)
        # the part of an object's vertex is that of the nearest skin
        corners = found["skin_part"][skin.faces[triangle]]
        assert (corners == found["object_part"][hit][:, None]).any(axis=1).all()
        parts = set(np.unique(found["skin_part"]).tolist())
        assert parts <= set(range(-1, len(SEGMENTS)))
        assert len(parts) >= len(SEGMENTS) - 1
    scene = trimesh.load(folder / "grasp.glb", force="scene")
    assert sorted(scene.geometry) == ["hand", "object"]


def test_what_cannot_be_exported_is_told(plan: Path, rows: dict[int, dict[str, Any]]) -> None:
    study, out = Study.load(plan), plan.parent / "out"
    with pytest.raises(InputError, match="trial 9 is not in this study"):
        study.export(out, ["isaac"], trials=[9])
    with pytest.raises(InputError, match="want one of isaac, dexgraspbench, mesh, got 'urdf'"):
        study.export(out, ["urdf"])
