"""``warpjld score``: one command judges grasps of others, and says what is wrong with them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from warpjld.cli import main
from warpjld.cli.study import rows_of
from warpjld.errors import InputError

_PLAN = """seed = 1
trials = 1
[[hands]]
builtin = "right"
resolution = 1500
[[objects]]
builtin = "ball"
"""


def test_a_table_of_scores(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "study.toml").write_text(_PLAN)
    grasps = tmp_path / "grasps.csv"
    grasps.write_text("name,object,x,y,z,qw,qx,qy,qz,index.base.flexion\nfar,ball,0,0,0.5,1,0,0,0,20\n")
    command = ["score", str(grasps), "--plan", str(tmp_path / "study.toml"), "-o", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as done:
        main([*command, "--table", "csv", "--processes", "1", "--json"])
    assert done.value.code == 0
    assert json.loads(capsys.readouterr().out)["trials_run"] == 1
    with (tmp_path / "out" / "table.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["grasp"], row["status"], row["contacts"], row["success"]) == ("far", "no contact", "0", "false")


def test_a_mistake_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "grasps.csv").write_text("object,x\n")
    with pytest.raises(SystemExit) as done:
        main(["score", str(tmp_path / "grasps.csv"), "--hand", "builtin:right", "-q"])
    assert done.value.code == 1
    assert "want a hand and a folder of objects, or a study's plan" in capsys.readouterr().err


def test_rows_to_export() -> None:
    assert rows_of("0-3,7, 2") == [0, 1, 2, 3, 7]
    assert rows_of(None) is None
    for bad in ("", "a", "3-", "-3", "1,,2"):
        with pytest.raises(InputError, match="--only: want numbers of trials"):
            rows_of(bad)
