"""Files are there whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from warpjld.files import whole_file as whole_file_module
from warpjld.files.whole_file import part_of, whole_file


def test_it_becomes_the_file_when_all_is_written(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("before")
    with whole_file(path) as part:
        part.write_text("after")
        assert part.suffix == ".csv"
        assert path.read_text() == "before"
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]


def interrupted(path: Path) -> None:
    with whole_file(path) as part:
        part.write_text("half")
        raise KeyboardInterrupt


def test_what_fails_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("before")
    with pytest.raises(KeyboardInterrupt):
        interrupted(path)
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_parts_of_killed_processes_are_removed_and_no_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(whole_file_module, "_swept", set())
    gone = 2**22 + 7  # more than Linux numbers its processes to
    mine = part_of(tmp_path / "a.csv").name
    dead = tmp_path / mine.replace(f"part{os.getpid()}", f"part{gone}")
    elsewhere = tmp_path / f".a.part{gone}-00000000.csv"
    stranger = tmp_path / ".film.part17.rar"
    for file in (dead, elsewhere, stranger, tmp_path / mine):
        file.write_text("half")
    with whole_file(tmp_path / "b.csv") as part:
        part.write_text("whole")
    assert [file.exists() for file in (dead, elsewhere, stranger, tmp_path / mine)] == [False, True, True, True]
