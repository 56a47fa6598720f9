"""Contact solved beside the studio, and what it is shown as."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.simulation.report.table import JointOpening
from warpjld.studio.background import Background
from warpjld.studio.document import ScriptDocument
from warpjld.studio.making import Pressed, open_joints, pressed
from warpjld.studio.state import StudioState

HAND = "HAND LEFT BUILTIN RESOLUTION 1500\n"
PLATE = (
    HAND + "FRAMES 0 10\nOBJECT PLATE BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165\n"
    "MOVE LEFT 0 0 0.003 0\nMOVE LEFT 10 0 -0.0055 0\nFLESH LEFT INDEX ELEMENT 0.005\nPRESS 0 10 EVERY 5\n"
)


def quiet(what: str, done: int, total: int) -> None:
    """Nobody is told."""


@pytest.fixture
def state(tmp_path: Path) -> StudioState:
    return StudioState(ScriptDocument(tmp_path / "a.jld", PLATE), tmp_path / "out", within=[tmp_path])


def test_contact_is_seen_as_it_was_solved_until_the_script_changes(state: StudioState) -> None:
    state.frame = 10
    before = {one.name: one.vertices for one in state.shown()}
    seen: list[Pressed] = []
    state.solved = pressed(state.document.text, state.copied_scene(), quiet, seen.append)
    assert state.solved.simulation is not None
    frames = state.solved.simulation.solved.frames
    assert [[f.frame for f in one.surfaces.frames] for one in seen] == [
        [f.frame for f in frames[:k]] for k in range(1, len(frames) + 1)
    ]
    assert all(one.simulation is None and one.rows(10) == [] for one in seen)
    assert state.solved.rows(10)
    points = state.contacts()
    pad = state.scene.actors["LEFT"].skeleton.rest[state.scene.actors["LEFT"].skeleton.index("left.index.tip")]
    assert 0 < len(points) < 200
    assert np.linalg.norm(points - pad, axis=1).max() < 0.03
    after = {one.name: one.vertices for one in state.shown()}
    moved = np.linalg.norm(after["LEFT"] - before["LEFT"], axis=1)
    assert moved.max() > 1e-4
    state.coloring = "pressure"
    (colored,) = [one for one in state.shown() if one.colors is not None]
    assert colored.colors is not None
    assert len(np.unique(colored.colors, axis=0)) > 2
    view = state.solved.simulation.show()
    try:
        assert view.address in view._repr_html_()
        assert {*view._meshes} == {"LEFT", "PLATE"}
        assert len(view._frames) == len(frames) + 1
    finally:
        view.close()
    state.do("RATE 25")
    assert state.pressed is None
    assert np.array_equal({one.name: one.vertices for one in state.shown()}["LEFT"], before["LEFT"])


def test_joints_are_opened_as_suggested_inside_their_limits(tmp_path: Path) -> None:
    text = f"{HAND}JOINT left.index.knuckle2 FLEXION AT 10 20\nJOINT left.ring.base FLEXION AT 10 -44\n"
    state = StudioState(ScriptDocument(tmp_path / "a.jld", text), tmp_path / "out")
    suggested = [
        JointOpening("LEFT", 10.0, "left.index.knuckle2", 3.25, "open knuckle 2"),
        JointOpening("LEFT", 10.0, "left.ring.base", 8.0, "open base"),
    ]
    assert open_joints(state, suggested)
    low = state.channels()["left.ring.base.flexion"][0]
    angles = state.angles(10.0)
    assert angles["left.index.knuckle2.flexion"] == pytest.approx(16.75)
    assert angles["left.ring.base.flexion"] == pytest.approx(max(-52.0, low))
    state.undo()
    assert state.document.text == text


def test_without_press_there_is_nothing_to_solve(tmp_path: Path) -> None:
    state = StudioState(ScriptDocument(tmp_path / "a.jld", HAND), tmp_path / "out")
    with pytest.raises(InputError, match="nothing to solve"):
        pressed(state.document.text, state.copied_scene(), quiet)


@pytest.mark.parametrize("coloring", ["domains", "stretch"])
def test_skin_is_coloured_by_vertex(tmp_path: Path, coloring) -> None:
    text = f"{HAND}POSE LEFT FLAT 0\nPOSE LEFT FIST 10\n"
    state = StudioState(ScriptDocument(tmp_path / "a.jld", text), tmp_path / "out")
    state.coloring = coloring
    (rest,) = state.shown()
    state.frame = 10
    (bent,) = state.shown()
    assert rest.colors is not None
    assert bent.colors is not None
    assert rest.colors.shape == rest.vertices.shape
    assert rest.colors.dtype == np.uint8
    same = np.array_equal(rest.colors, bent.colors)
    assert same == (coloring == "domains")


def test_work_is_cancelled_where_it_tells_of_its_progress_and_its_errors_are_handed_on() -> None:
    ended = threading.Event()
    found: list[tuple[object, BaseException | None]] = []

    def end(result: object, error: BaseException | None) -> None:
        found.append((result, error))
        ended.set()

    work, begun = Background(lambda: None), threading.Event()

    def endless(progress) -> None:
        try:
            while True:
                begun.set()
                progress("step", 1, 2)
        except Exception:  # a solver that handles errors must not go on
            pass

    assert work.start("endless", endless, end)
    assert begun.wait(10)
    assert not work.start("another", endless, end)
    work.cancel()
    assert ended.wait(10)
    assert found.pop() == (None, None)
    ended.clear()

    def fails(progress) -> None:
        raise ValueError("broken")

    assert work.start("fails", fails, end)
    assert ended.wait(10)
    (result, error) = found.pop()
    assert result is None
    assert isinstance(error, ValueError)
    assert work.running is None


def test_work_that_tells_nothing_is_interrupted_but_never_while_it_imports(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "slow_module.py").write_text("import time\nfor k in range(150):\n    time.sleep(0.01)\nwhole = True\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr("warpjld.studio.background._PATIENCE", 0.1)
    ended, begun = threading.Event(), threading.Event()
    found: list[tuple[object, BaseException | None]] = []

    def end(result: object, error: BaseException | None) -> None:
        found.append((result, error))
        ended.set()

    def endless(progress) -> None:
        begun.set()
        import slow_module  # type: ignore[import-not-found]

        assert slow_module.whole
        while True:
            time.sleep(0.01)

    work = Background(lambda: None)
    assert work.start("endless", endless, end)
    assert begun.wait(10)
    work.cancel()
    assert ended.wait(20)
    assert found == [(None, None)]
    assert sys.modules.pop("slow_module").whole
    assert work.running is None
    assert work.start("another", lambda progress: 7, end)  # what comes next is not interrupted
    while len(found) < 2:
        assert ended.wait(10)
    assert found[1] == (7, None)
