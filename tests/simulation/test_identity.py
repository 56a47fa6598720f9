"""A state is gone on from by the solve that left it and by no other; what differs is named. Names may have blanks."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.script.runner import run_scene
from warpjld.simulation.simulate import Simulation

BLOCK = """
OBJECT block BOX 0.02 0.02 0.02 AT 0 0.0101 0
OBJECT ground BOX 0.1 0.02 0.1 AT 0 -0.01 0
PHYSICAL block LAW {law} YOUNG {young} ELEMENT 0.01
POINTS block top UPPER Y 0.1
VECTOR block top AT 0 0 0 0
VECTOR block top AT 2 0 {depth} 0
FRICTION {friction}
MOVE ground 0 0 0 0
MOVE ground 4 {slide} 0 0
GRAVITY 0 {pull} 0
PRESS 0 2 {options} STATE 'state.npz'
"""
PLAIN = {
    "law": "LINEAR",
    "young": 1e5,
    "depth": -5e-4,
    "friction": 0.5,
    "slide": 1e-4,
    "pull": 0,
    "options": "EVERY 1",
}


def solved(folder: Path, **other: object) -> Simulation:
    """A block pressed on moving ground, with or without a state there."""
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(BLOCK.format(**PLAIN | other))
    return run_contact(scene, folder)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("state")
    assert solved(out).solved.resumed == 0
    return out


def test_the_same_solve_goes_on(folder: Path) -> None:
    assert solved(folder).solved.resumed == 2


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"law": "NEO-HOOKE"}, "PHYSICAL BLOCK: law"),
        ({"young": 9e5}, "PHYSICAL BLOCK: young"),
        ({"friction": 0.1}, "FRICTION BLOCK GROUND"),
        ({"depth": -7e-4}, "path of BLOCK"),
        ({"slide": -4e-4}, "path of GROUND"),
        ({"pull": -9.81}, "GRAVITY"),
        ({"options": "EVERY 2"}, "frames"),
        ({"options": "EVERY 1 METHOD PAPER"}, "PRESS: method"),
    ],
)
def test_another_solve_is_refused_and_says_in_what_it_differs(
    folder: Path, other: dict[str, object], named: str
) -> None:
    with pytest.raises(InputError, match=rf"state.npz: this state belongs to another scene: .*{named}"):
        solved(folder, **other)


def test_another_version_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.__version__", "99")
    with pytest.raises(InputError, match=r"another scene: version differ"):
        solved(folder)


def test_names_with_blanks_are_pressed_through_to_the_table(rig: Rig, tmp_path: Path) -> None:
    scene = Scene(say=lambda text: None)
    scene.add("left index", rig)
    Interpreter(scene).run_text(
        'OBJECT "index plate" BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165\n'
        'MOVE "LEFT INDEX" 0 0 0.002 0\nMOVE "LEFT INDEX" 6 0 -0.006 0\nFLESH "left index" INDEX ELEMENT 0.004\n'
        "FRAMES 5 6\nPRESS 0 6 EVERY 3\nTABLE 't.csv'"
    )
    summary = run_scene(scene, tmp_path)
    assert summary["press"]["status"] == "CONVERGED"
    with (tmp_path / "t.csv").open(encoding="utf-8") as file:
        last = [row for row in csv.DictReader(file) if row["digit"] == "index"][-1]
    assert (last["actor"], last["against"]) == ("LEFT INDEX", "INDEX PLATE")
    assert float(last["force_n"]) > 0.01
