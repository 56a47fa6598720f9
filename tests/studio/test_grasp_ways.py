"""Searches for grasps run beside the studio, and lead to the scene that a run from the top does."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.postures import POSTURES
from warpjld.script.grasping import Attempt
from warpjld.script.scene import Actor, Scene
from warpjld.studio.document import ScriptDocument
from warpjld.studio.grasp_ways import find_ways
from warpjld.studio.opening import opened_document
from warpjld.studio.performance import Performance
from warpjld.studio.state import StudioState

HAND = "HAND LEFT BUILTIN RESOLUTION 1500\nOBJECT B BALL 0.06 AT 0 0.1 0\n"
AUTO = "GRASP 5 25 LEFT B AUTO"
BEND = "left.index.base.flexion"


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Postures that were searched with: each search takes no time, and bends the index as far as its name is long."""
    seen: list[str] = []

    def quick(  # what searches do is tested where they are
        scene: Scene,
        actor: Actor,
        prop: object,
        side: str,
        first: float,
        last: float,
        tries: int,
        posture: str | None,
        digits: list[str],
    ) -> Attempt:
        assert digits == []
        if posture == "plate":
            raise InputError("no such grasp")
        seen.append(posture or "any")
        actor.set_keys(BEND, [last], np.radians(len(posture or "")), scene.spline)
        values = {"posture": posture, "score": float(len(posture or "")), "digits": ["left.index"]}
        return Attempt("GRASP B AUTO", last, actor.name, "B", "CONVERGED", "found", values)

    monkeypatch.setattr("warpjld.script.grasp_auto.grasp_by_itself", quick)
    return seen


@pytest.fixture
def state(tmp_path: Path) -> StudioState:
    return StudioState(ScriptDocument(tmp_path / "a.jld", HAND), tmp_path / "out")


def bend(scene: Scene) -> float:
    """Of the index at frame 25 [degrees]."""
    return float(np.degrees(scene.actors["LEFT"].value(BEND, 25.0)))


def test_ways_are_commands_with_their_scenes_the_best_first(state: StudioState, searched: list[str]) -> None:
    told: list[str] = []
    found: list[str] = []
    ways = find_ways(
        state.performance.beside(),
        state.document.path,
        HAND,
        AUTO,
        lambda what, done, total: told.append(f"{done}/{total}"),
        lambda way: found.append(way.line),
    )
    assert [way.line for way in ways] == [f"{AUTO} POSTURE {name}" for name in ("CYLINDER", "SPHERE", "PINCH")]
    assert [round(bend(way.scene)) for way in ways] == [8, 6, 5]
    assert told[: len(POSTURES)] == [f"{k}/{len(POSTURES)}" for k in range(len(POSTURES))]
    assert sorted(found) == sorted(way.line for way in ways)
    assert state.document.text == HAND
    assert not state.scene.actors["LEFT"].keyed


def test_a_way_is_no_part_of_the_script_until_it_is_taken(state: StudioState, searched: list[str]) -> None:
    way = find_ways(state.performance.beside(), state.document.path, HAND, AUTO, lambda *_: None)[0]
    count = len(searched)
    state.frame = 25
    before = state.shown()[0].vertices
    state.preview = HAND, way.scene
    assert not np.array_equal(state.shown()[0].vertices, before)
    state.performance.learn(way.performance)
    assert state.put(way.text)
    assert state.document.text == f"{HAND}{way.line}\n"
    assert round(bend(state.scene)) == 8
    state.undo()
    assert not state.scene.actors["LEFT"].keyed
    state.redo()
    assert round(bend(state.scene)) == 8
    assert len(searched) == count  # nothing was searched for again


def test_no_way_says_why(state: StudioState, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise InputError("too wide for this hand")

    monkeypatch.setattr("warpjld.script.grasp_auto.grasp_by_itself", none)
    with pytest.raises(InputError, match="too wide"):
        find_ways(state.performance.beside(), state.document.path, HAND, AUTO, lambda *_: None)


def test_what_searches_is_deferred_and_dropped_where_the_script_has_changed(
    state: StudioState, searched: list[str]
) -> None:
    waiting = []

    def defer(text: str, then) -> None:
        waiting.append((state.performance.beside(), text, then))

    def finish() -> None:
        performance, text, then = waiting.pop()
        thread = threading.Thread(target=performance.run, args=(text, state.document.path))
        thread.start()
        thread.join()
        state.performance.learn(performance)
        then()

    state.defer = defer
    assert state.do(f"{AUTO} POSTURE SPHERE")
    assert state.document.text == HAND
    assert searched == []
    finish()
    assert state.document.text == f"{HAND}{AUTO} POSTURE SPHERE\n"
    assert round(bend(state.scene)) == 6
    assert state.do(f"MACRO TAKE\n{AUTO} POSTURE PINCH\nEND\nTAKE")
    assert len(waiting) == 1  # a macro that searches, too
    state.write(f"{HAND}RATE 25\n")
    finish()
    assert state.document.text == f"{HAND}RATE 25\n"
    assert "not used" in state.messages[-1]


def test_a_script_that_searches_is_opened_first_and_searched_in_the_background(
    tmp_path: Path, searched: list[str]
) -> None:
    script, table = tmp_path / "grasp.jld", tmp_path / "later.jld"
    table.write_text("RATE 25\n")
    script.write_text(f'{HAND}{AUTO} POSTURE SPHERE\nINCLUDE "later.jld"\n')
    state = opened_document(script, tmp_path / "out")
    assert searched == []
    assert list(state.scene.actors) == ["LEFT"]  # what comes before the search is there
    assert list(state.scene.props) == ["B"]
    assert not state.broken
    begun = []
    state.begin(lambda text, then: begun.append((text, then)))
    ((text, then),) = begun
    assert text == state.document.text
    ran = state.performance.beside()
    ran.run(text, script)
    state.performance.learn(ran)
    then()
    assert searched == ["sphere"]
    assert round(bend(state.scene)) == 6
    assert state.scene.rate == 25  # the file named after the search may be read, too
    assert len(begun) == 1


def test_files_that_changed_are_read_again(tmp_path: Path, searched: list[str]) -> None:
    included = tmp_path / "rate.jld"
    included.write_text("RATE 25\n")
    text, path = f'INCLUDE "rate.jld"\n{HAND}{AUTO} POSTURE SPHERE\n', tmp_path / "a.jld"
    performance = Performance(tmp_path / "out", say=lambda line: None)
    performance.run(text, path)
    performance.run("", path)
    performance.run(text, path)
    assert searched == ["sphere"]
    performance.run("", path)
    included.write_text("RATE 50\n# changed\n")
    performance.run(text, path)
    assert searched == ["sphere", "sphere"]
    assert performance.scene.rate == 50
