"""USD through the process in which it is read: nothing is lost on the way, and damaged lengths cost little."""

from __future__ import annotations

import struct
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from tests.fuzz.sound import sound
from warpjld.errors import InputError
from warpjld.io import load_rig
from warpjld.io.identity import files_of
from warpjld.io.usd.separate_rig import load_usd_rig
from warpjld.io.usd.skin import read_usd_rig
from warpjld.motion.animations import animation_names
from warpjld.motion.separate_usd import load_usd_animation
from warpjld.motion.usd_animation import read_usd_animation
from warpjld.runtime.separate_process import running_process

pytest.importorskip("pxr")


def _same(one: object, other: object) -> None:
    for name in (field.name for field in fields(one)):  # type: ignore[arg-type]
        ours, theirs = getattr(one, name), getattr(other, name)
        if isinstance(ours, np.ndarray):
            np.testing.assert_array_equal(ours, theirs, strict=True)
        elif name == "tree":
            _same(ours, theirs)
        else:
            assert ours == theirs, name


def test_what_comes_back_is_what_was_read(tmp_path: Path) -> None:
    path = sound("a.usdc", tmp_path)
    _same(load_usd_rig(path), read_usd_rig(path))
    _same(load_usd_animation(path, rate=40.0), read_usd_animation(path, rate=40.0))
    assert animation_names(path) == ("Animation",)
    other = tmp_path / "b.usda"
    other.write_text("#usda 1.0\n(\n    subLayers = [@./a.usdc@]\n)\n")
    assert files_of(other) == [path.resolve()]
    assert files_of(tmp_path / "missing.usda") == []


def test_a_length_that_lies_is_refused_before_it_is_allocated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_READER_BYTES", "100000000")
    path = sound("a.usdc", tmp_path)
    whole = path.read_bytes()
    corners = struct.pack("<Q", 3 * len(read_usd_rig(path).faces))
    assert whole.count(corners) == 1
    path.write_bytes(whole.replace(corners, struct.pack("<Q", 1 << 28)))
    with pytest.raises(InputError, match=r"a\.usdc: .*(Corrupt asset|needs more than)"):
        load_rig(path)
    told = Path(f"/proc/{running_process().pid}/status")
    if told.exists():
        (held,) = (int(line.split()[1]) for line in told.read_text().splitlines() if line.startswith("VmHWM"))
        assert held < 500_000  # kB; the array would take a gigabyte
