"""What is done by mouse is a line of the script, and what the script describes is what is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.script.run_script import run_script
from warpjld.studio.document import ScriptDocument
from warpjld.studio.key_lines import with_keys
from warpjld.studio.state import StudioState

HAND = "HAND LEFT BUILTIN RESOLUTION 1500\n"


@pytest.fixture
def state(tmp_path: Path) -> StudioState:
    return StudioState(ScriptDocument(tmp_path / "a.jld", HAND), tmp_path / "out", within=[tmp_path])


def test_frames_are_those_of_a_run_bit_for_bit(state: StudioState, tmp_path: Path) -> None:
    state.set_angles({"left.index.base.flexion": 33.337, "left.thumb.base.pivot": -12.0})
    state.frame = 12
    state.do("POSE LEFT FIST 12 SHARE 70")
    state.frame = 20
    state.set_angles({"left.wrist.flexion": -21.5, "left.index.base.flexion": 3.0})
    state.do("OBJECT APPLE BALL 0.05 AT 0 0.1 0")
    state.do("MOVE APPLE 0 0 0 0.01")
    state.do("MOVE LEFT 5 0 0 0.2")
    seen = {}
    for frame in (0, 7, 20, 13):
        state.frame = frame
        seen[frame] = {one.name: one.vertices for one in state.shown()}
    state.do('EXPORT "surface.npz"')
    run_script(state.document.save(), tmp_path / "run", say=lambda line: None)
    hand = np.load(tmp_path / "run" / "surface.npz")["vertices"]
    apple = np.load(tmp_path / "run" / "surface-apple.npz")["vertices"]
    assert len(hand) == 21
    for frame, surfaces in seen.items():
        assert np.array_equal(surfaces["LEFT"], hand[frame])
        assert np.array_equal(surfaces["APPLE"], apple[frame])


def test_a_slider_edits_its_own_line_at_the_end_and_nothing_before(state: StudioState) -> None:
    state.set_angles({"left.index.base.flexion": 10})
    state.set_angles({"left.index.base.flexion": 20})
    assert state.document.text == f"{HAND}JOINT left.index.base FLEXION AT 0 20\n"
    state.do('PICTURE 0 "a.png"')
    state.set_angles({"left.index.base.flexion": 30})
    assert state.document.text.splitlines()[1:] == [
        "JOINT left.index.base FLEXION AT 0 20",
        'PICTURE 0 "a.png"',
        "JOINT left.index.base FLEXION AT 0 30",
    ]
    assert state.angles()["left.index.base.flexion"] == pytest.approx(30)


def test_angles_beyond_a_limit_are_held_at_it(state: StudioState) -> None:
    assert state.set_angles({"left.index.base.flexion": 500, "left.wrist.flexion": -500})
    assert state.angles()["left.index.base.flexion"] == pytest.approx(90)
    assert state.angles()["left.wrist.flexion"] == pytest.approx(-70)


def test_limits_between_hundredths_of_a_degree_are_not_passed(state: StudioState) -> None:
    state.do("LIMIT left.index.base FLEXION -1.004 33.3366")
    assert state.set_angles({"left.index.base.flexion": 90})
    assert state.document.text.endswith("AT 0 33.33\n")
    assert state.set_angles({"left.index.base.flexion": -90})
    assert state.document.text.endswith("AT 0 -1\n")


def test_what_cannot_be_done_leaves_the_script_as_it_was_and_is_shown(state: StudioState) -> None:
    before = state.document.text
    assert not state.do("GRASP 0 10 LEFT NOTHING")
    assert state.document.text == before
    assert "there is no object NOTHING" in str(state.error)
    assert not state.broken
    assert state.do("RATE 25")
    assert state.error is None


def test_a_typed_fault_is_kept_with_its_line_and_mouse_waits_for_its_mending(state: StudioState) -> None:
    state.write(f"{HAND}RATE fast\nFRAMES 0 9\n")
    assert state.broken
    assert state.error is not None
    assert state.error.line == 2  # type: ignore[attr-defined]
    assert not state.set_angles({"left.index.base.flexion": 10})
    assert "RATE fast" in state.document.text
    state.write(f"{HAND}RATE 25\nFRAMES 0 9\n")
    assert state.error is None
    assert state.span == (0, 9)


def test_everything_is_undone_in_turn(state: StudioState) -> None:
    texts = [state.document.text]
    for act in (
        lambda: state.set_angles({"left.index.base.flexion": 10}),
        state.key_all,
        lambda: state.do("KEYS COPY 0 10"),
        lambda: state.do("KEYS DELETE 0"),
        lambda: state.write(state.document.text + "RATE 25\n"),
    ):
        act()
        texts.append(state.document.text)
    assert len(set(texts)) == len(texts)
    for text in texts[-2::-1]:
        state.undo()
        assert state.document.text == text
        assert state.error is None
    for text in texts[1:]:
        state.redo()
        assert state.document.text == text
    assert state.scene.rate == 25
    assert state.keys == [10]


def test_of_two_hands_the_chosen_one_moves(tmp_path: Path) -> None:
    text = f"{HAND}HAND LEFT BUILTIN RESOLUTION 1500 NAME OTHER\n"
    state = StudioState(ScriptDocument(tmp_path / "a.jld", text), tmp_path / "out")
    state.choose("LEFT")
    assert state.set_angles({"left.index.base.flexion": 10})
    assert state.scene.actors["LEFT"].keyed
    assert not state.scene.actors["OTHER"].keyed
    state.choose("OTHER")
    assert state.set_angles({"left.index.base.flexion": 20})
    assert state.scene.actors["OTHER"].keyed


@pytest.mark.parametrize("text", ["", "RATE 25", "RATE 25\n"])
def test_keys_as_lines_of_any_script(text: str) -> None:
    made = with_keys(text, {"left.index.base.flexion": 1 / 3}, 2.5)
    assert made.splitlines()[-1] == "JOINT left.index.base FLEXION AT 2.5 0.33"
    assert with_keys(made, {"left.index.base.flexion": 4}, 2.5).splitlines()[-1].endswith("AT 2.5 4")
