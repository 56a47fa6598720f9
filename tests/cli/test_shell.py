"""``warpjld shell``: lines through a pipe, and the conversation behind it."""

import os
import subprocess
import sys

import pytest

from warpjld.errors import InputError
from warpjld.script.session import Session

pytestmark = pytest.mark.usefixtures("quick_hands")

HAND = "HAND LEFT BUILTIN RESOLUTION 1500"


@pytest.fixture
def session(tmp_path):
    said: list[str] = []
    session = Session(tmp_path / "out", say=said.append)
    session.said = said
    return session


def pipe(text: str, folder, *arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "warpjld", "shell", *arguments],
        input=text,
        text=True,
        capture_output=True,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        check=False,
    )


def test_commands_through_a_pipe(tmp_path) -> None:
    (tmp_path / "start.jld").write_text(HAND)
    done = pipe(
        "WRIST LEFT FLEXION AT 0 0\nWRIST LEFT FLEXION AT 4 40\nSHOW VALUES 2\n\n"
        "SIZE 80 60\nSHOW WIREFRAME 2\nQUIT\nNO",
        tmp_path,
        "start.jld",
    )
    assert done.returncode == 0, done.stderr
    assert "left.wrist.flexion                      20.000°  in-between" in done.stdout
    assert done.stdout.splitlines()[-1] == os.path.join("out", "wireframe-2.png")
    assert (tmp_path / "out" / "wireframe-2.png").is_file()


def test_an_error_in_a_pipe_ends_it_with_its_line(tmp_path) -> None:
    done = pipe("PRINT 1\n\nPRINT )\nPRINT 2\n", tmp_path)
    assert done.returncode == 1
    assert done.stdout == "1\n"
    assert "error: <shell>:3:7: expected a word, a number or a quoted text, found ')'" in done.stderr


def test_a_macro_takes_several_lines(session) -> None:
    for line in ("MACRO HI name", "  PRINT hi $name", "END"):
        assert session.unfinished == (line != "MACRO HI name")
        assert session.type(line)
    assert not session.unfinished
    session.type("hi you")
    assert session.said == ["hi you"]
    assert {"HI", "FINGER1", "KNUCKLES2", "RUN", "INDEX", "FLEXION"} <= set(session.names())


def test_an_unfinished_macro_at_the_end_is_an_error(session) -> None:
    session.type("MACRO HI")
    with pytest.raises(InputError, match="this MACRO has no END"):
        session.end()


def test_an_error_in_a_macro_forgets_it(session) -> None:
    session.type("MACRO HI")
    with pytest.raises(InputError):
        session.type("PRINT )")
    assert not session.unfinished


def test_undo_takes_the_last_line_back(session) -> None:
    for line in (HAND, "WRIST LEFT FLEXION AT 0 10", "WRIST LEFT FLEXION AT 5 20", "PRINT x"):
        session.type(line)
    session.type("undo")
    assert session.said[-1] == "undone: WRIST LEFT FLEXION AT 5 20"
    assert session.scene.actor().key_frames == [0]
    assert session.said.count("x") == 1


def test_what_was_typed_can_be_saved_and_run(session, tmp_path) -> None:
    start = tmp_path / "start.jld"
    start.write_text(HAND + "\n")
    session.run_file(start)
    for line in ("MACRO BEND x", " WRIST LEFT FLEXION AT 0 $x", "END", "BEND 10", "SHOW ACTORS", "EXPORT 'a.npz'"):
        session.type(line)
    session.type(f"SAVE '{tmp_path / 'saved.jld'}'")
    session.type("RUN")
    assert (tmp_path / "out" / "a.npz").is_file()
    again = Session(tmp_path / "again")
    again.run_file(tmp_path / "saved.jld")
    assert again.scene.actor().key_frames == [0]
    assert [output.name for output in again.scene.outputs] == ["a.npz"]
    with pytest.raises(InputError, match="cannot write"):
        session.type(f"SAVE '{tmp_path / 'none' / 'a.jld'}'")


def test_quit(session) -> None:
    assert session.type("PRINT 1")
    assert not session.type("quit")
    with pytest.raises(InputError, match="RUN takes no arguments"):
        session.type("RUN 3")


def test_a_line_that_fails_half_way_changes_nothing(session) -> None:
    session.type(HAND)
    for line in ("MACRO TWO", "WRIST LEFT FLEXION AT 3 10", "WRIST LEFT FLEXION AT 4 1e300", "END"):
        session.type(line)
    with pytest.raises(InputError, match="or less"):
        session.type("TWO")
    assert not session.scene.actor().keyed


def test_undo_takes_no_hand_apart(session, monkeypatch) -> None:
    session.type(HAND)
    rig = session.scene.actor().rig
    for frame in range(3):
        session.type(f"WRIST LEFT FLEXION AT {frame} 10")
    monkeypatch.setattr("warpjld.hand.kept.kept_hand", None)  # whoever builds it again fails
    for frame in (2, 1, 0):
        assert session.scene.actor().key_frames == [float(k) for k in range(frame + 1)]
        session.type("UNDO")
    assert session.scene.actor().rig is rig
    assert not session.scene.actor().keyed


def test_what_was_typed_is_kept_when_the_program_itself_fails(session) -> None:
    assert session.autosave() is None
    session.type("RATE 25")
    session.type("SIZE 64 48")
    kept = session.autosave()
    assert kept is not None
    assert kept.read_text() == "RATE 25\nSIZE 64 48\n"
