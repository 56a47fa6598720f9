"""What an earlier run left is checked before it counts: what is damaged runs again, and that is said."""

from __future__ import annotations

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


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("done")
    run_study(Dice(trials=4), out, processes=1, table="csv")
    return out


@pytest.mark.parametrize("damage", DAMAGE)
def test_damaged_trials_run_again_and_it_is_said(done: Path, damage: str) -> None:
    before = (done / "table.csv").read_bytes()
    file = done / "trials" / "0000" / "0000003.json"
    edit_trial(file, DAMAGE[damage])
    again = run_study(Dice(trials=4), done, processes=1, table="csv")
    assert again.ran == 1
    assert "1 trials in" in again.notes[0]
    assert again.notes[0].endswith("are damaged and run again: 3")
    assert (done / "table.csv").read_bytes() == before


def test_a_digit_that_changed_is_noticed(done: Path) -> None:
    before = (done / "table.csv").read_bytes()
    file = done / "trials" / "0000" / "0000002.json"
    content = file.read_bytes()
    place = content.index(b'"thrown": 0.') + len(b'"thrown": 0.')
    file.write_bytes(content[:place] + (b"1" if content[place : place + 1] != b"1" else b"2") + content[place + 1 :])
    assert run_study(Dice(trials=4), done, processes=1, table="csv").ran == 1
    assert (done / "table.csv").read_bytes() == before


@pytest.mark.parametrize("content", ["", "[1]", '{"seed": ', "[" * 100_000], ids=["empty", "list", "cut", "deep"])
def test_a_damaged_study_file_sets_the_trials_aside(tmp_path: Path, content: str) -> None:
    run_study(Dice(trials=3), tmp_path, processes=1, table="csv")
    before = (tmp_path / "table.csv").read_bytes()
    (tmp_path / "study.json").write_text(content)
    again = run_study(Dice(trials=3), tmp_path, processes=1, table="csv")
    assert again.ran == 3
    assert "study.json is damaged: the old trials are in" in again.notes[0]
    assert len(list((tmp_path / "trials.unknown1").rglob("*.json"))) == 3
    assert (tmp_path / "table.csv").read_bytes() == before


def test_the_archive_of_poses_holds_them_and_nothing_else(done: Path) -> None:
    with np.load(done / "poses.npz") as file:
        assert sorted(file.files) == ["pose a", "pose a.trials", "pose b", "pose b.trials"]


def test_a_title_may_cost_5_dollars(done: Path, tmp_path: Path) -> None:
    from warpjld.study.rates import success_rates

    rates = success_rates([{"status": "x", "wide": True, "table": "$a {"}], "wide", ("table",))
    pictures = write_summary(tmp_path, "Cost $5 {and $6", rates, [], [])
    assert pictures[0].stat().st_size > 0
