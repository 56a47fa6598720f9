"""Real trials: small hands on built-in objects, measured, resumed, repeated."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.grasp.segments import SEGMENTS
from warpjld.study.experiment import generator
from warpjld.study.grasping import GraspExperiment, load_plan
from warpjld.study.pool import perform
from warpjld.tables.columns import checked_values
from warpjld.tables.files import read_table

_ROOT = Path(__file__).resolve().parents[3]

PLAN = """seed = 5
trials = {trials}
friction = [0.4, 0.9]
[[hands]]
name = "hand"
builtin = "{side}"
resolution = 1500
[[objects]]
builtin = "ball"
[[objects]]
builtin = "box"
mass = 0.2
"""


_PARTS = ("thumb", "index", "middle", "ring", "pinky", "palm")


def plan(folder: Path, trials: int = 4, side: str = "right", more: str = "") -> Path:
    path = folder / "study.toml"
    path.write_text(PLAN.format(trials=trials, side=side) + more)
    return path


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> GraspExperiment:
    return GraspExperiment(load_plan(plan(tmp_path_factory.mktemp("plan"))))


@pytest.fixture(scope="module")
def rows(experiment: GraspExperiment) -> list[dict[str, object]]:
    return [perform(experiment, trial)[0] for trial in range(4)]


def test_every_trial_has_a_row_that_fits_the_schema(experiment: GraspExperiment, rows: list[dict]) -> None:
    assert [row["friction"] for row in rows] == [0.4, 0.9, 0.4, 0.9]
    assert [row["object"] for row in rows] == ["ball", "ball", "box", "box"]
    assert {row["status"] for row in rows} <= {"closed", "no contact", "missed", "no room"}
    assert sum(row["status"] == "closed" for row in rows) >= 2
    for row in rows:
        values = {name: value for name, value in row.items() if name in {c.name for c in experiment.columns}}
        assert checked_values(values, experiment.columns) == values


def test_measures_agree_with_one_another(rows: list[dict]) -> None:
    closed = [row for row in rows if row["status"] == "closed"]
    for row in closed:
        parts = sum(row[f"area_{part}"] for part in ("thumb", "index", "middle", "ring", "pinky", "palm"))
        assert row["area"] == pytest.approx(parts)
        assert (row["epsilon"] > 0.0) == row["closed"]
        assert row["success"] == (row["closed"] and row["penetration"] <= 1e-3)
        assert row["held"] == 6 or not row["closed"]
        assert (row["displacement"] is None) == (row["held"] < 6)
        assert row["touching"].split() == [part for part in _PARTS if row[f"area_{part}"] > 0.0]
        assert 0.0 <= row["lift_least"] <= row["lift"]
        assert (row["lift_least"] > 0.0) == (row["held"] == 6)
        assert row["self_penetration"] >= 0.0
    boxes = [row for row in closed if row["object"] == "box"]
    assert all(row["mass"] == 0.2 for row in boxes)


def test_a_ball_weighs_what_its_volume_does(rows: list[dict]) -> None:
    ball = next(row for row in rows if row["object"] == "ball" and row["mass"] is not None)
    assert ball["mass"] == pytest.approx(300.0 * np.pi / 6.0 * 0.065**3, rel=0.01)
    assert ball["torque_scale"] == pytest.approx(0.0325, rel=1e-3)


def test_contact_patches_lie_on_the_object(experiment: GraspExperiment) -> None:
    outcome = experiment.run(0, generator(experiment.seed, 0))
    points, normals = outcome.arrays["hand/contact_point"], outcome.arrays["hand/contact_normal"]
    assert points.shape == (len(SEGMENTS), 3)
    touching = np.isfinite(points[:, 0])
    assert touching.sum() == outcome.values["contacts"] > 0
    # a patch's centre lies a little inside the ball it wraps; its normal points to the ball's centre
    assert np.linalg.norm(points[touching], axis=1) == pytest.approx(np.full(touching.sum(), 0.0325), abs=0.002)
    inward = -points[touching] / np.linalg.norm(points[touching], axis=1, keepdims=True)
    assert (np.einsum("ci,ci->c", inward, normals[touching]) > 0.98).all()


def test_a_trial_does_not_depend_on_what_ran_before(experiment: GraspExperiment, rows: list[dict]) -> None:
    assert [perform(experiment, trial)[0] for trial in (3, 1)] == [rows[3], rows[1]]


def test_more_trials_leave_trial_k_as_it_is(tmp_path: Path, rows: list[dict]) -> None:
    longer = GraspExperiment(load_plan(plan(tmp_path, trials=100)))
    assert perform(longer, 1)[0] == rows[1]
    assert longer.identity() == GraspExperiment(load_plan(plan(tmp_path, trials=4))).identity()


def test_a_posture_beyond_the_limits_is_refused(tmp_path: Path) -> None:
    bad = plan(tmp_path, more='[posture."index.knuckle2"]\nflexion = -30\n')
    with pytest.raises(InputError, match=r"hand hand: posture index.knuckle2 flexion is -30°; its limits are 0° to"):
        GraspExperiment(load_plan(bad)).check()


def test_hashes_of_files_are_part_of_a_studys_identity(tmp_path: Path) -> None:
    import trimesh

    trimesh.creation.icosphere(radius=0.03).export(tmp_path / "pea.stl")
    path = plan(tmp_path, more='[[objects]]\nfile = "pea.stl"\n')
    before = load_plan(path).identity()
    assert len(before["objects"][2]["file"]["sha256"]) == 64
    assert str(tmp_path) not in json.dumps(before)
    trimesh.creation.icosphere(radius=0.04).export(tmp_path / "pea.stl")
    assert load_plan(path).identity() != before


def test_an_object_in_another_unit_is_suspicious(tmp_path: Path) -> None:
    import trimesh

    trimesh.creation.cylinder(4.0, 12.0).export(tmp_path / "mug.obj")
    (line,) = GraspExperiment(load_plan(plan(tmp_path, more='[[objects]]\nfile = "mug.obj"\n'))).doubts()
    assert line.startswith("mug measures 12 m, 6")
    assert 'unit = "cm" would make it 0.12 m' in line
    right = plan(tmp_path, more='[[objects]]\nfile = "mug.obj"\nunit = "cm"\n')
    assert GraspExperiment(load_plan(right)).doubts() == []


def test_an_unusable_object_stops_the_study_before_it_begins(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty.obj").write_text("# nothing\n")
    path = plan(tmp_path, more='[[objects]]\nfile = "empty.obj"\n')
    with pytest.raises(SystemExit) as stopped:
        main(["study", str(path), "-o", str(tmp_path / "out"), "-q"])
    assert stopped.value.code == 1
    assert "empty.obj" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_checked_plan_is_told_in_words_and_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = plan(tmp_path, trials=1), tmp_path / "out"
    said = []
    for switch in ((), ("--json",), ("-q",)):
        with pytest.raises(SystemExit) as stopped:
            main(["study", str(path), "-o", str(out), "--check", *switch])
        assert stopped.value.code == 0
        said.append(capsys.readouterr().out)
    told = json.loads(said[1])
    assert (told["plan"], told["trials"], told["combinations_tried"]) == (str(path), 1, 1)
    assert f"1 trials of 1 of {told['combinations']} combinations" in said[0]
    assert all(note in said[0] for note in told["notes"])
    assert said[2] == ""
    assert not out.exists()


def test_the_command_runs_and_repeats(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pyarrow")
    path, out = plan(tmp_path, trials=1), tmp_path / "out"
    with pytest.raises(SystemExit) as first:
        main(["study", str(path), "-o", str(out), "--processes", "1", "--json"])
    assert first.value.code == 0
    assert json.loads(capsys.readouterr().out)["trials_run"] == 1
    for name in ("table.parquet", "poses.npz", "manifest.json", "summary.png", "summary.html"):
        assert (out / name).stat().st_size > 0
    rows = read_table(out / "table.parquet")
    with pytest.raises(SystemExit) as repeated:
        main(["study", str(path), "-o", str(out), "--rerun", "0", "--json"])
    assert repeated.value.code == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["row"] == rows[0]
    assert answer["differences"] == []
    assert rows[0]["status"] == "closed"
    assert any(name.endswith("grasp.png") for name in answer["files"])


@pytest.mark.slow
def test_killed_and_resumed_gives_the_same_bytes(tmp_path: Path) -> None:
    path = plan(tmp_path, trials=24)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), str(_ROOT / "kernels")])}

    def command(out: str, processes: int) -> list[str]:
        words = ["study", str(path), "-o", str(tmp_path / out), "--processes", str(processes), "--table", "both", "-q"]
        return [sys.executable, "-m", "warpjld", *words]

    subprocess.run(command("whole", 2), env=environment, check=True)
    study = subprocess.Popen(command("killed", 2), env=environment)
    deadline = time.monotonic() + 300.0
    while len(list((tmp_path / "killed" / "trials").glob("*/*.json"))) < 10:
        assert study.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    study.send_signal(signal.SIGKILL)
    study.wait()
    assert not (tmp_path / "killed" / "table.parquet").exists()
    subprocess.run(command("killed", 1), env=environment, check=True)
    for name in ("table.parquet", "table.csv", "poses.npz"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_the_example_is_a_study_of_a_minute() -> None:
    example = load_plan(_ROOT / "examples" / "study.toml")
    assert all(hand.file is None for hand in example.hands)
    assert all(thing.file is None for thing in example.objects)
    combinations = len(example.hands) * len(example.objects) * len(example.scales) * len(example.frictions)
    assert combinations <= example.trials <= 40


def test_the_docs_name_every_column_and_key(experiment: GraspExperiment) -> None:
    from warpjld.study.run import table_columns

    text = (_ROOT / "docs" / "reference" / "grasp-study.md").read_text(encoding="utf-8")
    for column in table_columns(experiment):
        assert re.search(rf"^\| `{column.name}` \| {column.kind} \| {re.escape(column.unit)}", text, re.M), column.name
        assert column.about in text, column.name
    settings = experiment.settings
    for key in (*vars(settings.wrist), *vars(settings.measuring)):
        assert f"`{key}`" in text, key
