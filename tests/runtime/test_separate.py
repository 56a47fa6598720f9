"""Reading in a process of its own: its limits, its crashes and what it refuses are errors of the file, in one line."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.runtime import separate_process
from warpjld.runtime.separate import separately

_HERE = "tests.runtime.test_separate"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="limits of memory are POSIX's")


def read(folder: Path, path: Path, what: str, number: int = 0) -> Any:
    """What the tests below let the process do."""
    if what == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if what == "memory":
        np.ones(number)
    if what == "wait":
        time.sleep(number)
    if what == "refuse":
        raise InputError("line is wrong", path=path, line=3)
    if what == "raise":
        raise KeyError("points")
    np.save(folder / "a.npy", np.arange(number))
    return {"process": os.getpid(), "said": path.read_text()}


def _read(path: Path, *arguments: object) -> tuple[Any, int]:
    with separately((_HERE, "read"), path, "nothing", *arguments, per_byte=20) as answer:
        return answer.value, len(np.load(answer.folder / "a.npy"))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "a.txt").write_text("é\n")
    return tmp_path / "a.txt"


def test_one_process_answers_and_leaves_arrays(path: Path) -> None:
    (first, five), (second, seven) = _read(path, "", 5), _read(path, "", 7)
    assert (five, seven, first["said"]) == (5, 7, "é\n")
    assert first["process"] == second["process"] != os.getpid()
    assert separate_process.running_process().end() == 0
    assert _read(path, "", 5)[0]["process"] != first["process"]


def test_what_goes_wrong_is_one_line(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(path.parent)
    for arguments, message in {
        ("refuse",): r"^a\.txt:3: line is wrong$",
        ("raise",): r"^a\.txt: cannot be read as nothing: 'points' is missing$",
        ("crash",): r"^a\.txt: cannot be read as nothing: the process that reads it ends with code -11: .*reader-bytes",
        ("memory", 1 << 40): r"^a\.txt: cannot be read as nothing: it needs more than [\d,]+ bytes .*reader-bytes=",
    }.items():
        with pytest.raises(InputError, match=message):
            _read(Path("a.txt"), *arguments)
    assert _read(Path("a.txt"), "", 5)[1] == 5


def test_its_limits_are_those_of_this_process(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _read(path, "memory", 10_000_000)  # 80 MB
    monkeypatch.setenv("WARPJLD_LIMIT_READER_BYTES", "30000000")
    with pytest.raises(InputError, match="needs more than 30,000,060 bytes"):
        _read(path, "memory", 10_000_000)
    with path.open("ab") as file:
        file.truncate(1 << 30)  # nothing is stored: 20 bytes of memory for each of its own, but no more than is stated
    with pytest.raises(InputError, match="needs more than 150,000,000 bytes"):
        _read(path, "memory", 40_000_000)
    os.truncate(path, 3)
    monkeypatch.setenv("WARPJLD_LIMIT_READER_SECONDS", "1")
    with pytest.raises(InputError, match=r"not done after 1 s .*reader-seconds="):
        _read(path, "wait", 60)


def test_a_process_that_does_not_start_is_one_line(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    separate_process.running_process().end()
    monkeypatch.setattr("sys.executable", str(path.parent / "no-python"))
    with pytest.raises(InputError, match=r"a\.txt: cannot be read as nothing: .* does not start \(No such file"):
        _read(path, "", 5)


def test_a_fork_asks_a_process_of_its_own(path: Path) -> None:
    ours = _read(path, "", 5)[0]["process"]
    child = os.fork()
    if child == 0:
        same = separate_process.running_process().usable() and _read(path, "", 5)[0]["process"] == ours
        os._exit(int(same))
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert _read(path, "", 5)[0]["process"] == ours
