"""What an earlier run left is checked before it counts: what is damaged runs again, and that is said."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.study.dice import Dice, edit_trial
from warpjld.study import run_study
from warpjld.study.summary import write_summary

DAMAGE: dict[str, Callable[[dict[str, Any]], object]] = {
    "of another trial": lambda content: content.update(trial=4),
    "a column is missing": lambda content: content["row"].pop("wide"),
    "a column of another kind": lambda content: content["row"].update(thrown="much"),
    "arrays that are a list": lambda content: content.update(arrays=[1]),
    "an array of another shape": lambda content: next(iter(content["arrays"].values())).update(shape=[7, 7]),
    "no seconds": lambda content: content.update(seconds=None),
}
TRIALS = 8


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("done")
    run_study(Dice(trials=TRIALS), out, processes=1, table="csv")
    return out


def test_damaged_trials_run_again_and_it_is_said(done: Path) -> None:
    """Each in its own way, all but the first and the last."""
    before = (done / "table.csv").read_bytes()
    for trial, damage in enumerate(DAMAGE.values(), start=1):
        edit_trial(done / "trials" / "0000" / f"{trial:07d}.json", damage)
    again = run_study(Dice(trials=TRIALS), done, processes=1, table="csv")
    assert again.ran == len(DAMAGE) == TRIALS - 2
    assert f"{len(DAMAGE)} trials in" in again.notes[0]
    assert again.notes[0].endswith("are damaged and run again: 1, 2, 3, 4, 5, …")
    assert (done / "table.csv").read_bytes() == before


def test_a_digit_that_changed_is_noticed(done: Path) -> None:
    before = (done / "table.csv").read_bytes()
    file = done / "trials" / "0000" / "0000002.json"
    content = file.read_bytes()
    place = content.index(b'"thrown": 0.') + len(b'"thrown": 0.')
    file.write_bytes(content[:place] + (b"1" if content[place : place + 1] != b"1" else b"2") + content[place + 1 :])
    assert run_study(Dice(trials=TRIALS), done, processes=1, table="csv").ran == 1
    assert (done / "table.csv").read_bytes() == before


@pytest.mark.parametrize("content", ["", "[1]", '{"seed": ', "[" * 100_000], ids=["empty", "list", "cut", "deep"])
def test_a_damaged_study_file_sets_the_trials_aside(done: Path, tmp_path: Path, content: str) -> None:
    out = Path(shutil.copytree(done, tmp_path / "out"))
    before = (out / "table.csv").read_bytes()
    (out / "study.json").write_text(content)
    again = run_study(Dice(trials=TRIALS), out, processes=1, table="csv")
    assert again.ran == TRIALS
    assert "study.json is damaged: the old trials are in" in again.notes[0]
    assert len(list((out / "trials.unknown1").rglob("*.json"))) == TRIALS
    assert (out / "table.csv").read_bytes() == before


def test_the_archive_of_poses_holds_them_and_nothing_else(done: Path) -> None:
    with np.load(done / "poses.npz") as file:
        assert sorted(file.files) == ["pose a", "pose a.trials", "pose b", "pose b.trials"]


def test_a_title_may_cost_5_dollars(done: Path, tmp_path: Path) -> None:
    from warpjld.study.rates import success_rates

    rates = success_rates([{"status": "x", "wide": True, "table": "$a {"}], "wide", ("table",))
    pictures = write_summary(tmp_path, "Cost $5 {and $6", rates, [], [])
    assert pictures[0].stat().st_size > 0
