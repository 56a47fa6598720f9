"""Running, stopping, resuming: always the same table."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.study.dice import Dice, edit_trial
from warpjld.errors import InputError, MissingExtraError
from warpjld.study import rerun_trial, run_study
from warpjld.tables.files import read_table

_ROOT = Path(__file__).resolve().parents[2]
_RESULTS = ("table.parquet", "table.csv", "poses.npz")


def _bytes(folder: Path, names: tuple[str, ...] = _RESULTS) -> list[bytes]:
    return [(folder / name).read_bytes() for name in names]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of 1,000 trials that nothing disturbed, in one process."""
    pytest.importorskip("pyarrow")
    folder = tmp_path_factory.mktemp("whole")
    run_study(Dice(), folder, processes=1, table="both")
    return folder


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One of thirty."""
    folder = tmp_path_factory.mktemp("calm")
    run_study(Dice(trials=30), folder, processes=1, table="csv")
    return folder


def test_killed_half_way_and_resumed_with_other_processes_gives_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), str(_ROOT / "kernels")])}
    command = [sys.executable, "-m", "tests.study.dice", str(tmp_path), "1000", "2", "0.002"]
    study = subprocess.Popen(command, cwd=_ROOT, env=environment)
    trials = tmp_path / "trials"
    deadline = time.monotonic() + 60.0
    while len(list(trials.glob("*/*.json"))) < 400:
        assert study.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    study.send_signal(signal.SIGKILL)
    study.wait()
    time.sleep(0.5)  # orphaned workers notice and go
    stopped = len(list(trials.glob("*/*.json")))
    assert 400 <= stopped < 1000
    time.sleep(0.3)
    assert len(list(trials.glob("*/*.json"))) == stopped
    assert not (tmp_path / "table.parquet").exists()

    result = run_study(Dice(), tmp_path, processes=3, table="both")
    assert result.ran == 1000 - stopped
    assert _bytes(tmp_path) == _bytes(whole)


def test_failing_trials_are_rows_and_count(whole: Path) -> None:
    rows = read_table(whole / "table.parquet")
    assert [row["trial"] for row in rows] == list(range(1000))
    assert rows[13]["status"] == "error"
    assert rows[13]["message"] == "fell off the table"
    assert "ZeroDivisionError: no table (dice.py:" in rows[14]["message"]
    assert rows[15]["thrown"] is None
    manifest = json.loads((whole / "manifest.json").read_text())
    assert manifest["statuses"] == {"thrown": 960, "error": 40}
    overall = manifest["rates"][0]
    assert overall["trials"] == 1000
    assert overall["successes"] == sum(row["wide"] is True for row in rows)
    assert sum(rate["trials"] for rate in manifest["rates"][1:]) == 1000
    assert overall["low"] < overall["successes"] / 1000 < overall["high"]


def test_trials_draw_their_own_numbers(whole: Path) -> None:
    rows = read_table(whole / "table.parquet")
    for trial in (0, 1, 999):
        rng = np.random.default_rng(np.random.SeedSequence(3, spawn_key=(trial,)))
        assert rows[trial]["thrown"] == rng.random()
    thrown = [row["thrown"] for row in rows if row["thrown"] is not None]
    assert len(set(thrown)) == len(thrown)


def test_arrays_are_stacked_with_the_trials_that_have_them(whole: Path) -> None:
    with np.load(whole / "poses.npz") as arrays:
        assert sorted(arrays.files) == ["pose a", "pose a.trials", "pose b", "pose b.trials"]
        assert arrays["pose a"].shape == (len(arrays["pose a.trials"]), 2, 40)
        assert arrays["pose b"].shape[1:] == (3, 40)
        assert 14 not in arrays["pose a.trials"]


def test_schema_is_in_the_file_and_wall_clock_is_not(whole: Path) -> None:
    import pyarrow.parquet as pq

    schema = pq.read_schema(whole / "table.parquet")
    assert schema.names == ["trial", "seed", "status", "message", "thrown", "wide", "table"]
    assert schema.field("thrown").metadata == {b"unit": b"m", b"description": b"A number."}
    manifest = json.loads((whole / "manifest.json").read_text())
    assert len(manifest["trial_seconds"]) == 1000
    assert manifest["thrown"] == sum(row["thrown"] is not None for row in read_table(whole / "table.parquet"))
    header, first = (whole / "table.csv").read_text().splitlines()[:2]
    assert header == "trial,seed,status,message,thrown,wide,table"
    assert float(first.split(",")[5]) == read_table(whole / "table.parquet")[0]["thrown"]


def test_a_trial_that_kills_its_worker_is_a_row(calm: Path, tmp_path: Path) -> None:
    run_study(Dice(trials=30, fatal=11), tmp_path, processes=2, table="csv")
    lines, others = ((folder / "table.csv").read_text().splitlines() for folder in (tmp_path, calm))
    assert lines[12].startswith('11,"(11,)",crashed,')
    assert lines[:12] + lines[13:] == others[:12] + others[13:]


def test_a_worker_killed_from_outside_is_survived(calm: Path, tmp_path: Path) -> None:
    result = run_study(Dice(trials=30, fatal_once=str(tmp_path / "mark")), tmp_path / "a", processes=2, table="csv")
    assert (tmp_path / "mark").exists()
    assert result.ran == 30
    assert _bytes(tmp_path / "a", ("table.csv", "poses.npz")) == _bytes(calm, ("table.csv", "poses.npz"))


def test_more_trials_later_keep_the_old_ones(calm: Path, tmp_path: Path) -> None:
    run_study(Dice(trials=10), tmp_path, processes=1, table="csv")
    assert run_study(Dice(trials=30), tmp_path, processes=1, table="csv").ran == 20
    assert _bytes(tmp_path, ("table.csv", "poses.npz")) == _bytes(calm, ("table.csv", "poses.npz"))


def test_another_study_in_the_folder_is_refused(tmp_path: Path) -> None:
    run_study(Dice(trials=2), tmp_path, processes=1, table="csv")
    with pytest.raises(InputError, match=r"other settings \(seed\)"):
        run_study(Dice(trials=2, seed=4), tmp_path, processes=1, table="csv")
    assert run_study(Dice(trials=2, seed=4), tmp_path, processes=1, table="csv", fresh=True).ran == 2


def test_a_damaged_trial_is_run_again(tmp_path: Path) -> None:
    run_study(Dice(trials=5), tmp_path, processes=1, table="csv")
    before = (tmp_path / "table.csv").read_bytes()
    (tmp_path / "trials" / "0000" / "0000003.json").write_text('{"trial": 3, "row"')
    assert run_study(Dice(trials=5), tmp_path, processes=1, table="csv").ran == 1
    assert (tmp_path / "table.csv").read_bytes() == before


def test_rerun_repeats_a_trial_exactly(whole: Path) -> None:
    again = rerun_trial(Dice(), whole, 42)
    assert again.differences == ()
    assert again.row == read_table(whole / "table.parquet")[42]
    assert [file.name for file in again.files] == ["row.json", "die.txt"]
    with pytest.raises(InputError, match="row 1000"):
        rerun_trial(Dice(), whole, 1000)


def test_rerun_tells_what_differs(tmp_path: Path) -> None:
    run_study(Dice(trials=2), tmp_path, processes=1, table="csv")
    shard = tmp_path / "trials" / "0000" / "0000001.json"
    edit_trial(shard, lambda content: content["row"].update(thrown=np.nextafter(content["row"]["thrown"], 2.0)))
    assert rerun_trial(Dice(trials=2), tmp_path, 1).differences == ("thrown",)


def test_a_missing_extra_is_told_before_the_first_trial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"warpjld\[study\]"):
        run_study(Dice(trials=1), tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert run_study(Dice(trials=1), tmp_path / "out", processes=1, table="csv").ran == 1


def test_bad_arguments_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="processes"):
        run_study(Dice(trials=1), tmp_path, processes=0, table="csv")
    with pytest.raises(InputError, match="table"):
        run_study(Dice(trials=1), tmp_path, table="xlsx")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="there is no study in this folder"):
        rerun_trial(Dice(trials=1), tmp_path, 0)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="is a file; want a folder"):
        run_study(Dice(trials=1), tmp_path / "file", table="csv")
