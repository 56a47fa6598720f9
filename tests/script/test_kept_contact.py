"""Contact that is solved is not lost: outputs that fail, Ctrl-C, damaged states."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warpjld.errors import InputError, WarpjldError
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.script.runner import run_scene
from warpjld.simulation import frames_run
from warpjld.simulation.simulate import KEPT

BLOCK = """
OBJECT block BOX 0.02 0.02 0.02 AT 0.5 0.0101 0
OBJECT ground BOX 0.1 0.02 0.1 AT 0.5 -0.01 0
PHYSICAL block LAW LINEAR YOUNG 1e5 ELEMENT 0.01
POINTS block top UPPER Y 0.1
VECTOR block top AT 0 0 0 0
VECTOR block top AT 4 0 -1e-3 0
FRICTION 0.5
MOVE ground 0 0 0 0
MOVE ground 4 1e-4 0 0
FRAMES 0 4
SIZE 64 48
"""


def scene_of(folder: Path, *lines: str) -> Scene:
    scene = Scene(folder=folder, say=lambda line: None, warn=lambda line: None)
    scene.add("A", _finger())
    Interpreter(scene).run_text(BLOCK + "\n".join(lines))
    return scene


def _finger() -> Any:
    from tests.finger import finger

    return finger()


def shapes(folder: Path) -> np.ndarray:
    """The block's over time, shape (F, V, 3)."""
    with np.load(folder / "e-block.npz") as file:
        return np.asarray(file["vertices"])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What comes of it undisturbed, with a state."""
    out = tmp_path_factory.mktemp("whole")
    run_scene(scene_of(out, "PRESS 0 4 STATE 's.npz'", "EXPORT 'e.npz'"), out)
    return out


def test_what_is_solved_is_kept_where_an_output_fails(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("warpjld.script.making.draw_picture", refuse)
        scene = scene_of(tmp_path, "PRESS 0 4", "PICTURE 2 'p.png'")
        with pytest.raises(WarpjldError, match=r"not made: 'p\.png'"):
            run_scene(scene, tmp_path / "out")
    assert f'PRESS … STATE "{KEPT}" exports them' in scene.warnings[-1]
    again = scene_of(tmp_path, f"PRESS 0 4 STATE '{KEPT}'", "PICTURE 2 'p.png'", "EXPORT 'e.npz'")
    monkeypatch.setattr("warpjld.simulation.frames_run.FramesRun.solve", refuse)  # nothing is solved again
    run_scene(again, tmp_path / "out")
    assert (tmp_path / "out" / "p.png").exists()
    np.testing.assert_array_equal(shapes(tmp_path / "out"), shapes(whole))


def test_it_is_kept_where_every_output_fails_and_the_folder_would_not_be_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("a fault")

    monkeypatch.setattr("warpjld.script.making.write_motions", broken)
    scene = scene_of(tmp_path, "PRESS 0 1")
    with pytest.raises(RuntimeError, match="a fault"):
        run_scene(scene, tmp_path / "out")
    assert [file.name for file in (tmp_path / "out").iterdir()] == [KEPT]
    assert KEPT in scene.warnings[-1]


def interrupting(monkeypatch: pytest.MonkeyPatch, at: float) -> None:
    """Ctrl-C after a frame's equilibrium is found and before it counts as done."""
    solved_frame = frames_run.solved_frame

    def solved(frame: float, instants: Any, states: Any) -> Any:
        if frame == at:
            raise KeyboardInterrupt
        return solved_frame(frame, instants, states)

    monkeypatch.setattr(frames_run, "solved_frame", solved)


def test_frames_solved_before_ctrl_c_are_made_named_and_gone_on_from(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        interrupting(patch, 3.0)
        scene = scene_of(tmp_path, "PRESS 0 4", "EXPORT 'e.npz'")
        with pytest.raises(InputError, match=r"interrupted after frame 2; frames 1 to 2 and all files are in .*out"):
            run_scene(scene, tmp_path / "out")
    np.testing.assert_array_equal(shapes(tmp_path / "out")[:3], shapes(whole)[:3])
    run_scene(scene_of(tmp_path, f"PRESS 0 4 STATE '{KEPT}'", "EXPORT 'e.npz'"), tmp_path / "out")
    assert np.abs(np.diff(shapes(whole), axis=0)).max(axis=(1, 2)).min() > 1e-5  # it moves at every frame
    for name in ("contact.csv", "e.npz", "e-block.npz"):
        assert (tmp_path / "out" / name).read_bytes() == (whole / name).read_bytes()


def test_ctrl_c_before_anything_is_solved_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    interrupting(monkeypatch, 1.0)
    with pytest.raises(KeyboardInterrupt):
        run_scene(scene_of(tmp_path, "PRESS 0 1"), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def _put(name: str, change: Callable[[Any], Any]) -> Callable[[dict[str, Any]], None]:
    def damage(content: dict[str, Any]) -> None:
        content[name] = change(content[name])

    return damage


def _edit(**changed: Any) -> Callable[[Any], str]:
    """One edit of an angle, of an actor that is not in the scene, as a state's text."""
    return lambda a: json.dumps([{"actor": "A", "joint": 0, "kept": 0, "frame": 1, "value": 0, "channel": 0} | changed])


def _holed(array: np.ndarray) -> np.ndarray:
    out = array.copy()
    out.flat[-1] = np.nan
    return out


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (_put("frames.displacement", _holed), "frame 4: displacements: not finite"),
        (_put("frames.displacement", lambda a: a[:, 1:]), "displacements: want float64 of shape"),
        (_put("frames.reactions", lambda a: a.astype(np.float32)), "reactions: want float64"),
        (_put("frames.nodal", lambda a: a[:, :0]), "contact forces: want"),
        (_put("frames.nodal_contact.area", _holed), "nodal area: not finite"),
        (_put("frames.frame", lambda a: a + 1.0), "it holds frames 2, 3, 4, 5; want the first ones of 1, 2, 3, 4"),
        (_put("frames.frame", lambda a: a[:0]), "it holds no frame"),
        (_put("frames.reactions", lambda a: a[:1]), "reactions: want one a frame, 4, got an array of shape (1, "),
        (_put("frames.bonded", lambda a: a + 0.5), "frame 1: shares of bonds: want 0 to 1"),
        (_put("memory0.bond_gap", lambda a: 0.0 * np.nan_to_num(a) + 1e200), "contact state 0: bond_gap: above 1e+100"),
        (_put("frames.solves", lambda a: -a), "want numbers from 0 on"),
        (_put("time", lambda a: a + 0.5), "is not that of frame 4"),
        (_put("memories", lambda a: np.int64(0)), "contact states of 0 pairs; want "),
        (_put("memory0.pressure", _holed), "contact state 0: pressure: not finite"),
        (_put("memory0.sticking", lambda a: a.astype(float)), "sticking: want bool"),
        (_put("memory0.friction", lambda a: a[:1]), "friction: want float64 of shape"),
        (_put("correction_rate", lambda a: a[:1]), "rates of correction"),
        (_put("edits", _edit()), "not there"),
        (_put("edits", _edit(kept="x")), "want float"),
        (_put("edits", lambda a: "[1]"), "cannot be read as a state"),
        (_put("limits", lambda a: '{"caps": [1]}'), "cannot be read as a state"),
        (_put("missed", lambda a: "{"), "cannot be read as a state"),
        (_put("identity", lambda a: "[]"), "belongs to another scene"),
        (lambda content: content.pop("time"), "time"),
    ],
)
def test_a_damaged_state_is_refused_in_one_line(
    whole: Path, tmp_path: Path, damage: Callable[[dict[str, Any]], None], says: str
) -> None:
    with np.load(whole / "s.npz") as file:
        content = dict(file)
    damage(content)
    np.savez(tmp_path / "s.npz", **content)
    with pytest.raises(InputError) as caught:
        run_contact(scene_of(tmp_path, "PRESS 0 4 STATE 's.npz'"), tmp_path)
    assert "s.npz" in str(caught.value)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_state_that_unpacks_to_more_than_it_is(whole: Path, tmp_path: Path) -> None:
    with np.load(whole / "s.npz") as file:
        np.savez_compressed(tmp_path / "s.npz", **dict(file), zeros=np.zeros(1_000_000))
    with pytest.raises(InputError, match="unpack to more"):
        run_contact(scene_of(tmp_path, "PRESS 0 4 STATE 's.npz'"), tmp_path)
