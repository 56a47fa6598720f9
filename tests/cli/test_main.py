"""What all commands share: help, misspelt names, and errors in one line."""

from __future__ import annotations

import errno
import json
import math
import subprocess
import sys
from pathlib import Path

import click
import numpy as np
import pytest

from warpjld.cli import main
from warpjld.cli.answer import answer

COMMANDS = ["run", "shell", "inspect", "calibrate", "deform", "bake", "study", "fem"]


def run(*arguments: str) -> int | str | None:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code


def test_help_lists_every_command_and_the_units(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--help") == 0
    said = capsys.readouterr().out
    assert [line.split()[0] for line in said.splitlines() if line.strip().startswith(tuple(COMMANDS))] == COMMANDS
    assert "lengths are metres, angles degrees" in said


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help_and_one_name_for_its_output(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(name, "--help") == 0
    said = capsys.readouterr().out
    assert said.startswith(f"Usage: warpjld {name} ")
    assert "-o, --out " in said


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "shell"])
def test_every_command_that_ends_by_itself_answers_in_json(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(name, "--help") == 0
    assert "  --json " in capsys.readouterr().out


def test_an_answer_is_ascii_and_without_nan(capsys: pytest.CaptureFixture[str]) -> None:
    answer({"a": [1.5, math.nan, {"b": -math.inf}], "c": ("µ", np.float64(2.0)), "d": True})
    said = capsys.readouterr().out
    assert said.isascii()
    assert json.loads(said) == {"a": [1.5, None, {"b": None}], "c": ["µ", 2.0], "d": True}


@pytest.mark.parametrize(
    ("name", "says"),
    [("runn", "there is no command 'runn'; did you mean run?"), ("xyz", "no command 'xyz'; want one of run, shell, ")],
)
def test_misspelt_commands(name: str, says: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(name, "a.jld") == 2
    assert says in capsys.readouterr().err


def test_a_folder_that_is_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").touch()
    example = Path(__file__).resolve().parents[2] / "examples" / "inflate_ball.toml"
    assert run("fem", str(example), "-o", str(tmp_path / "out"), "-q") == 1
    assert capsys.readouterr().err == f"error: {tmp_path / 'out'}: is a file; want a folder to write into\n"


def test_too_little_memory_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    @click.command()
    def greedy() -> None:
        np.empty(10**17)

    monkeypatch.setattr("warpjld.cli.study.study_command", greedy)
    assert run("study") == 1
    assert capsys.readouterr().err.startswith("error: not enough memory: Unable to allocate")


def test_a_full_disk_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    @click.command()
    def full() -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "out/a.npz")

    monkeypatch.setattr("warpjld.cli.study.study_command", full)
    assert run("study") == 1
    assert capsys.readouterr().err == "error: out/a.npz: No space left on device\n"


def test_the_process_ends_with_all_that_was_printed_and_registered() -> None:
    script = (
        "import atexit, sys, threading, time\n"
        "atexit.register(print, 'registered')\n"
        "threading.Thread(target=lambda: (time.sleep(0.2), print('thread'))).start()\n"
        "from warpjld.__main__ import run\n"
        "sys.argv = ['warpjld', *sys.argv[1:]]\n"
        "run()\n"
    )
    for arguments, code in ((["--version"], 0), (["deform"], 2), (["inspect", "no such file.glb"], 1)):
        done = subprocess.run([sys.executable, "-c", script, *arguments], capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        lines = done.stdout.splitlines()
        assert "thread" in lines  # on a slow machine before what the command prints
        assert lines[-1] == "registered"
        assert "Traceback" not in done.stderr
