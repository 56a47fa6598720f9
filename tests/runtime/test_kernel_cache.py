"""Kernels that are damaged on the disk are noticed before they are run, named, and compiled anew."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from warpjld.runtime import quiet
from warpjld.runtime.kernel_cache import remove_damaged_kernels

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="what objects look like is known on Linux only")


def _object(seed: int) -> bytes:
    """Something that has an ELF file's header and as many section headers as that says."""
    code = bytes((seed * k) % 251 for k in range(500))
    header = b"\x7fELF\x02" + bytes(35) + struct.pack("<Q", 564) + bytes(10) + struct.pack("<HHH", 64, 3, 1)
    return header[:64].ljust(64, b"\0") + code + bytes(3 * 64)


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    """Three modules, one of them another program's."""
    for name, seed in (("wp_warpjld_kernels.a_12ab34c", 3), ("wp_warpjld_kernels.b_b_0", 5), ("wp_other.a_12ab34c", 7)):
        (tmp_path / name).mkdir()
        (tmp_path / name / f"{name}.cpu1.o").write_bytes(_object(seed))
        (tmp_path / name / f"{name}.meta").write_text("{}")
    (tmp_path / "wp_other.a_12ab34c" / "wp_other.a_12ab34c.meta").write_text("")
    return tmp_path


@LINUX
def test_what_is_whole_stays(cache: Path) -> None:
    assert remove_damaged_kernels(cache) == ([], True)
    assert remove_damaged_kernels(cache) == ([], True)
    assert len(list(cache.iterdir())) == 3
    assert remove_damaged_kernels(cache / "missing") == ([], True)


def _cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-1])


def _flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[100] ^= 4
    file.write_bytes(bytes(content))


def _make_folder(file: Path) -> None:
    file.unlink()
    file.mkdir()


@LINUX
@pytest.mark.parametrize("seen", [False, True])
@pytest.mark.parametrize(
    "damage", [_cut, _make_folder, lambda file: file.write_bytes(b""), lambda file: file.write_bytes(b"\x17" * 900)]
)
def test_what_is_damaged_goes_seen_before_or_not(cache: Path, seen: bool, damage: Callable[[Path], object]) -> None:
    if seen:
        remove_damaged_kernels(cache)
    damage(next((cache / "wp_warpjld_kernels.b_b_0").glob("*.o")))
    assert remove_damaged_kernels(cache) == (["b_b"], True)
    assert sorted(place.name for place in cache.iterdir()) == ["wp_other.a_12ab34c", "wp_warpjld_kernels.a_12ab34c"]


@LINUX
def test_a_bit_that_changed_since_it_was_seen_is_noticed(cache: Path) -> None:
    remove_damaged_kernels(cache)
    _flip(next((cache / "wp_warpjld_kernels.a_12ab34c").glob("*.o")))
    assert remove_damaged_kernels(cache) == (["a"], True)


def test_damaged_descriptions(cache: Path) -> None:
    next((cache / "wp_warpjld_kernels.a_12ab34c").glob("*.meta")).write_text("{")
    assert "a" in remove_damaged_kernels(cache)[0]


def test_where_it_cannot_be_removed_kernels_are_kept_elsewhere(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[bool] = []
    next((cache / "wp_warpjld_kernels.a_12ab34c").glob("*.meta")).write_text("{")
    monkeypatch.setattr(shutil, "rmtree", lambda *_, **__: None)
    monkeypatch.setattr(quiet, "_move_cache", lambda: moved.append(True))
    (line,) = quiet._checked(cache)
    assert line.startswith(f"damaged kernels in {cache} (a")
    assert moved


def test_a_cache_that_cannot_be_written_is_named_and_kernels_are_kept_elsewhere(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import warp

    warp.init()
    moved: list[bool] = []
    monkeypatch.setattr(warp.config, "kernel_cache_dir", str(cache))
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setattr(quiet, "_move_cache", lambda: moved.append(True))
    assert quiet._initialised() == [
        f"kernels cannot be kept ({cache}: permission denied): they are compiled anew; "
        "WARP_CACHE_PATH names another folder"
    ]
    assert moved


@pytest.mark.slow
def test_the_program_tells_and_goes_on(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("frame,index.base.flexion\n0,0\n3,40\n")
    arguments = ["deform", "builtin:left", "--motion", str(tmp_path / "m.csv"), "-o", str(tmp_path / "m.npz")]
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}

    def run() -> subprocess.CompletedProcess[str]:
        call = [sys.executable, "-m", "warpjld", *arguments]
        return subprocess.run(call, env=environment, capture_output=True, text=True, check=True)

    assert "damaged" not in run().stderr
    first = (tmp_path / "m.npz").read_bytes()
    for file in (tmp_path / "cache").rglob("*covering_runs*.o"):
        _flip(file)
    assert "damaged kernels in" in run().stderr
    assert (tmp_path / "m.npz").read_bytes() == first
    assert "damaged" not in run().stderr
