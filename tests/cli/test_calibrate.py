"""``warpjld calibrate`` from the outside."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from warpjld.cli.calibrate import calibrate_command
from warpjld.covering.kept import bind_kept
from warpjld.covering.parameters import load_parameters, save_parameters
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.motion import load_motion


@pytest.fixture(scope="module")
def hand(data: Path) -> Path:
    return data / "hand_webxr_generic" / "left.glb"


def test_parameters_are_written_and_loaded(hand: Path, tmp_path: Path) -> None:
    out = tmp_path / "hand.json"
    arguments = [str(hand), "-o", str(out), "--poses", "6", "--iterations", "4", "--json"]
    result = CliRunner().invoke(calibrate_command, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    summary = json.loads(result.stdout)
    assert summary["poses"] == 6
    assert summary["guarded"] > 2
    assert summary["evaluations"] <= 4
    assert summary["after"]["loss"] < summary["before"]["loss"]
    assert summary["after"]["faces_folded"] <= 1.02 * summary["before"]["faces_folded"] + 2
    load_parameters(out, load_rig(hand).skeleton)
    assert [p.name for p in tmp_path.iterdir()] == ["hand.json"]


def test_a_table_for_people(hand: Path, tmp_path: Path) -> None:
    start = tmp_path / "start.json"
    few = ["--poses", "4", "--iterations", "2"]
    assert CliRunner().invoke(calibrate_command, [str(hand), "-o", str(start), "-q", *few]).output == ""
    out = tmp_path / "again.json"
    result = CliRunner().invoke(
        calibrate_command, [str(hand), "-o", str(out), "--start", str(start), "--domains", "skin", *few]
    )
    assert "before" in result.stdout
    for row in ("volume error, worst", "roughness, typical", "faces folded"):
        assert row in result.stdout
    assert f"{out} written" in result.stdout


@pytest.fixture(scope="module")
def shapes(hand: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Curls that other parameters than the defaults make, and a motion file of the same poses."""
    folder = tmp_path_factory.mktemp("shapes")
    rig = load_rig(hand)
    channels = ["index.base.flexion", "index.knuckle2.flexion", "thumb.knuckle2.flexion"]
    angles = np.array([[30.0, 20.0, 10.0], [60.0, 80.0, 50.0], [80.0, 95.0, 30.0]])
    motion = folder / "poses.csv"
    rows = [",".join(["frame", *channels]), *(",".join(map(str, [f, *row])) for f, row in enumerate(angles.tolist()))]
    motion.write_text("\n".join(rows) + "\n", encoding="utf-8")
    covering, _ = bind_kept(rig)
    wanted = replace(covering.parameters, inflation=covering.parameters.inflation + 0.4)
    poses = load_motion(motion, rig).poses
    vertices = rig.surface.to_source(covering.with_parameters(wanted).deform(poses))
    np.savez(folder / "shapes.npz", vertices=vertices, channels=np.array(channels), angles=angles)
    np.savez(folder / "bare.npz", vertices=vertices)
    save_parameters(folder / "wanted.json", rig.skeleton, wanted)
    return folder


@pytest.mark.parametrize("own_poses", [pytest.param(True, marks=pytest.mark.slow), False])
def test_targets(hand: Path, shapes: Path, tmp_path: Path, own_poses: bool) -> None:
    out = tmp_path / "found.json"
    name = "shapes.npz" if own_poses else "bare.npz"
    arguments = [str(hand), "-o", str(out), "--targets", str(shapes / name)]
    arguments += [] if own_poses else ["--motion", str(shapes / "poses.csv")]
    result = CliRunner().invoke(calibrate_command, [*arguments, "--json"], catch_exceptions=False)
    summary = json.loads(result.stdout)
    assert summary["poses"] == 3
    assert summary["before"]["rms_mm"] > 0.05
    assert summary["after"]["rms_mm"] < 1e-3
    skeleton = load_rig(hand).skeleton
    found, wanted = (load_parameters(p, skeleton) for p in (out, shapes / "wanted.json"))
    bent = skeleton.index("index.knuckle2")
    assert found.inflation[bent] == pytest.approx(wanted.inflation[bent], abs=1e-2)


def test_targets_for_people(hand: Path, shapes: Path, tmp_path: Path) -> None:
    out = tmp_path / "found.json"
    arguments = [str(hand), "-o", str(out), "--targets", str(shapes / "shapes.npz"), "--iterations", "2"]
    result = CliRunner().invoke(calibrate_command, arguments, catch_exceptions=False)
    assert "3 target shapes" in result.stdout
    assert "distance, typical [mm]" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["builtin:middle"], "want builtin:left, builtin:right or builtin:body"),
        (["missing.glb"], "no such file"),
        (["builtin:left", "-o", "nowhere/at/all.json"], "no such folder"),
        (["builtin:left", "--motion", "a.csv"], "but there is no --targets"),
        (["builtin:left", "--targets", "a.npz", "--poses", "3"], "all poses of the file are used"),
    ],
)
def test_bad_input(arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        CliRunner().invoke(calibrate_command, arguments, catch_exceptions=False)
    assert not list(tmp_path.iterdir())


def test_targets_that_are_not_there(hand: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        CliRunner().invoke(
            calibrate_command, [str(hand), "--targets", str(tmp_path / "none.npz")], catch_exceptions=False
        )


def test_targets_are_not_overwritten(hand: Path, shapes: Path) -> None:
    targets = str(shapes / "shapes.npz")
    with pytest.raises(InputError):
        CliRunner().invoke(calibrate_command, [str(hand), "-o", targets, "--targets", targets], catch_exceptions=False)
