"""The folder in which things are kept from one process to the next."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from warpjld.files.kept_files import CACHE_VARIABLE, keep, kept_folder


def test_it_moves_and_is_switched_off(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for word in ("", "off", "0"):
        monkeypatch.setenv(CACHE_VARIABLE, word)
        assert kept_folder() is None
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    assert kept_folder() == tmp_path
    monkeypatch.delenv(CACHE_VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    folder = kept_folder()
    assert folder is not None
    assert "warpjld" in folder.parts


def test_it_does_not_grow_for_ever(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for age in range(1, 5):
        old = tmp_path / f"{age}.npz"
        old.write_bytes(b"x" * 10)
        os.utime(old, (1e9 - age, 1e9 - age))
    monkeypatch.setattr("warpjld.files.kept_files._MOST_BYTES", 30)
    keep(tmp_path / "new.npz", lambda place: _written(place, 10))
    assert sorted(file.name for file in tmp_path.iterdir()) == ["1.npz", "2.npz", "new.npz"]
    keep(tmp_path / "large.npz", lambda place: _written(place, 100))
    assert [file.name for file in tmp_path.iterdir()] == ["large.npz"]  # the newest stays, however large it is


def test_what_cannot_be_written_is_not_kept(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    keep(tmp_path / "file" / "new.npz", lambda place: _written(place, 10))

    def full(place: Path) -> None:
        place.write_bytes(b"half")
        raise OSError("no space left")

    keep(tmp_path / "new.npz", full)
    assert [file.name for file in tmp_path.iterdir()] == ["file"]


def _written(place: Path, size: int) -> None:
    place.write_bytes(b"x" * size)
