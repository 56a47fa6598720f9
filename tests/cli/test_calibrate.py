"""``warpjld calibrate`` from the outside."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from warpjld.cli.calibrate import command
from warpjld.covering.parameters import load_parameters
from warpjld.errors import InputError
from warpjld.io import load_rig


@pytest.fixture(scope="module")
def hand(data: Path) -> Path:
    return data / "hand_webxr_generic" / "left.glb"


def test_parameters_are_written_and_loaded(hand: Path, tmp_path: Path) -> None:
    out = tmp_path / "hand.json"
    arguments = [str(hand), "-o", str(out), "--poses", "6", "--iterations", "4", "--json"]
    result = CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    summary = json.loads(result.stdout)
    assert summary["poses"] == 6
    assert summary["iterations"] <= 4
    assert summary["after"]["loss"] < summary["before"]["loss"]
    load_parameters(out, load_rig(hand).skeleton)
    assert [p.name for p in tmp_path.iterdir()] == ["hand.json"]


def test_a_table_for_people(hand: Path, tmp_path: Path) -> None:
    start = tmp_path / "start.json"
    few = ["--poses", "4", "--iterations", "2"]
    assert CliRunner().invoke(command, [str(hand), "-o", str(start), "-q", *few]).output == ""
    out = tmp_path / "again.json"
    result = CliRunner().invoke(command, [str(hand), "-o", str(out), "--start", str(start), "--domains", "skin", *few])
    assert "before" in result.stdout
    assert "volume error, worst" in result.stdout
    assert f"{out} written" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["builtin:middle"], "want builtin:left or builtin:right"),
        (["missing.glb"], "no such file"),
        (["builtin:left", "-o", "nowhere/at/all.json"], "no such folder"),
    ],
)
def test_bad_input(arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=message):
        CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert not list(tmp_path.iterdir())
