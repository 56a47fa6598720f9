"""Sessions at a terminal: errors, Ctrl-C, Ctrl-D and users' commands do not end them; lines are kept."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from warpjld.cli.shell import _guarded, _lines
from warpjld.errors import InputError
from warpjld.script.session import Session

pty = pytest.importorskip("pty", reason="terminals of this kind are POSIX's")
termios = pytest.importorskip("termios")

COMMANDS = """
import sys
from warpjld.script import command

@command("LEAVE", syntax="LEAVE", help="Calls exit().", group="Test")
def leave(scene, arguments):
    sys.exit(3)

@command("BREAK", syntax="BREAK", help="Fails.", group="Test")
def broken(scene, arguments):
    return {}["nothing"]
"""


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(tmp_path / "out", say=lambda text: None)


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (KeyboardInterrupt(), "stopped; the effects of this line are undone"),
        (InputError("no such thing"), "error: no such thing"),
        (ZeroDivisionError("x"), "unexpected ZeroDivisionError: x; the lines typed so far are in"),
        (SystemExit(3), "unexpected SystemExit: 3; the lines typed so far are in"),
        (MemoryError(), "unexpected MemoryError"),
    ],
)
def test_whatever_a_line_comes_to_the_session_goes_on(
    session: Session, capsys: pytest.CaptureFixture[str], error: BaseException, told: str
) -> None:
    session.type("RATE 25")

    def fails() -> object:
        raise error

    assert _guarded(session, fails)
    assert told in capsys.readouterr().err
    assert not _guarded(session, lambda: session.type("QUIT"))


def test_lines_are_kept_as_they_come_and_gone_when_they_are_saved(session: Session, tmp_path: Path) -> None:
    kept = tmp_path / "out" / "autosaved.jld"
    _guarded(session, lambda: session.type("RATE 25"))
    _guarded(session, lambda: session.type("SIZE 64 48"))
    assert kept.read_text() == "RATE 25\nSIZE 64 48\n"
    _guarded(session, lambda: session.type("UNDO"))
    assert kept.read_text() == "RATE 25\n"
    _guarded(session, lambda: session.type(f"SAVE '{tmp_path / 'mine.jld'}'"))
    assert not kept.exists()


def test_what_another_session_left_stays(session: Session, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "autosaved.jld").write_text("RATE 12\n")
    session.type("RATE 25")
    assert session.autosave() == tmp_path / "out" / "autosaved-2.jld"
    assert (tmp_path / "out" / "autosaved.jld").read_text() == "RATE 12\n"


def test_lines_end_only_when_their_end_is_told_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    typed = iter(["a", EOFError(), "b", KeyboardInterrupt(), ValueError("history"), "c", EOFError(), EOFError(), "d"])

    def read(prompt: str = "") -> str:
        one = next(typed)
        if isinstance(one, BaseException):
            raise one
        return one

    monkeypatch.setattr("warpjld.cli.shell._reader", lambda names: read)
    monkeypatch.setattr("builtins.input", lambda prompt: read())
    monkeypatch.setattr(click, "echo", lambda *_, **__: None)
    assert list(_lines(list, lambda: "", lambda: "")) == ["a", "b", "c"]


class Terminal:
    """The program at a pseudo-terminal."""

    def __init__(self, folder: Path) -> None:
        (folder / "commands.py").write_text(COMMANDS)
        self._ours, theirs = pty.openpty()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "warpjld", "shell", "--commands", "commands.py", "-o", "out"],
            cwd=folder,
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "TERM": "dumb", "HOME": str(folder)},
            start_new_session=True,
        )
        os.close(theirs)
        self.said = ""
        self._prompts = 0

    def wait(self, text: str, count: int = 1) -> None:
        """Until it has said something so many times."""
        until = time.monotonic() + 60.0
        while self.said.count(text) < count:
            assert time.monotonic() < until, f"no {text!r} in {self.said!r}"
            if not select.select([self._ours], [], [], 1.0)[0]:
                continue
            try:
                self.said += os.read(self._ours, 4096).decode(errors="replace")
            except OSError:  # the terminal's other end is closed
                assert self.said.count(text) >= count, f"no {text!r} in {self.said!r}"

    def type(self, text: str) -> None:
        """At the next prompt, when keys go to the program: before, the terminal itself would take Ctrl-D."""
        self._prompts += 1
        self.wait("jld> ", self._prompts)
        until = time.monotonic() + 60.0
        while termios.tcgetattr(self._ours)[3] & termios.ICANON:
            assert time.monotonic() < until, "the terminal still edits lines itself"
            time.sleep(0.01)
        os.write(self._ours, text.encode())

    def vanish(self) -> None:
        """Close the terminal under the program, which is not its controlling one: no signal tells."""
        os.close(self._ours)


@pytest.fixture
def shell(tmp_path: Path) -> Iterator[Terminal]:
    made = Terminal(tmp_path)
    yield made
    made.process.kill()  # nothing else ends it where a test failed
    made.process.wait()


def test_a_session_at_a_terminal(tmp_path: Path, shell: Terminal) -> None:
    shell.wait("QUIT leaves.")
    shell.type("RATE 25\r")
    for number, line in enumerate(("BREAK", "LEAVE", "NONSENSE"), 1):
        shell.type(f"{line}\r")
        shell.wait("error: ", number)
    shell.type("\x04")
    shell.wait("or Ctrl-D once more")
    shell.type("SIZE 64 48\r")
    shell.type("QUIT\r")
    shell.wait("not saved; the lines typed so far are in")
    assert shell.process.wait(30) == 0
    assert (tmp_path / "out" / "autosaved.jld").read_text() == "RATE 25\nSIZE 64 48\n"
    assert "Traceback" not in shell.said


def test_a_session_that_is_told_to_end_keeps_its_lines(tmp_path: Path, shell: Terminal) -> None:
    shell.wait("QUIT leaves.")
    shell.type("RATE 25\r")
    shell.type("PRINT 'here'\r")
    shell.wait("here", 2)
    shell.process.send_signal(signal.SIGHUP)
    assert shell.process.wait(30) == 130
    assert (tmp_path / "out" / "autosaved.jld").read_text() == "RATE 25\n"


def test_a_session_ends_with_its_terminal_and_keeps_its_lines(tmp_path: Path, shell: Terminal) -> None:
    shell.wait("QUIT leaves.")
    shell.type("RATE 25\r")
    shell.type("PRINT 'here'\r")
    shell.wait("here", 2)
    shell.vanish()
    assert shell.process.wait(30) == 130
    assert (tmp_path / "out" / "autosaved.jld").read_text() == "RATE 25\n"
