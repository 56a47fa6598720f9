"""All or nothing, whatever the format: bad input and exceptions leave no file."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError, WarpjldError
from warpjld.geometry.surface import Surface
from warpjld.io.caches import FORMATS, Cache, open_cache

every_format = pytest.mark.parametrize("suffix", FORMATS)


def _files(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*"))


@every_format
def test_lists_the_files_it_made(export: Callable[[str], Cache], tmp_path: Path, suffix: str) -> None:
    cache = export(f"new/folder/a{suffix}")
    assert cache.files
    assert sorted(path.name for path in cache.files) == _files(tmp_path / "new" / "folder")


@every_format
def test_writing_again_replaces(export: Callable[[str], Cache], tmp_path: Path, suffix: str) -> None:
    before = export(f"a{suffix}").files
    assert export(f"a{suffix}").files == before
    assert len(_files(tmp_path)) == len(before)


@every_format
def test_exception_leaves_nothing(surface: Surface, clip: np.ndarray, tmp_path: Path, suffix: str) -> None:
    cache = open_cache(tmp_path / f"a{suffix}", surface, frames=len(clip), rate=25)

    def fail() -> None:
        with cache:
            cache.write(clip)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert _files(tmp_path) == []
    assert cache.files == ()


@every_format
def test_failure_keeps_the_earlier_file(
    export: Callable[[str], Cache], surface: Surface, clip: np.ndarray, tmp_path: Path, suffix: str
) -> None:
    earlier = {path: path.read_bytes() for path in export(f"a{suffix}").files}
    with (
        pytest.raises(InputError, match="2 of 7 frames"),
        open_cache(tmp_path / f"a{suffix}", surface, frames=7, rate=24, start_frame=3) as cache,
    ):
        cache.write(clip[:2])
    assert {path: path.read_bytes() for path in earlier} == earlier
    assert len(_files(tmp_path)) == len(earlier)


@every_format
def test_left_unclosed_leaves_nothing(surface: Surface, clip: np.ndarray, tmp_path: Path, suffix: str) -> None:
    cache = open_cache(tmp_path / f"a{suffix}", surface, frames=len(clip), rate=25)
    cache.__enter__()
    cache.write(clip[:3])
    del cache
    gc.collect()
    assert _files(tmp_path) == []


@every_format
def test_surface_without_texture(surface: Surface, clip: np.ndarray, tmp_path: Path, suffix: str) -> None:
    bare = replace(surface, uv=None)
    with open_cache(tmp_path / f"a{suffix}", bare, frames=len(clip), rate=25) as cache:
        cache.write(clip)
    text = cache.files[0].read_bytes()
    assert not any(word in text for word in (b"\nvt ", b"primvars:st", b"TEXCOORD", b"uv.npy"))


@pytest.mark.parametrize(
    ("block", "message"),
    [
        (np.zeros((1, 50, 3), np.float32), r"want shape \(n, 45, 3\), got \(1, 50, 3\)"),
        (np.zeros((45, 3), np.float32), r"want shape \(n, 45, 3\), got \(45, 3\)"),
        (np.zeros((4, 45, 3), np.float32), "4 frames written, 3 were announced"),
        (np.full((1, 45, 3), np.nan, np.float32), "vertex 0 of frame 10 is not finite"),
    ],
)
def test_refuses_block(surface: Surface, tmp_path: Path, block: np.ndarray, message: str) -> None:
    with (
        pytest.raises(InputError, match=message),
        open_cache(tmp_path / "a.npz", surface, frames=3, rate=25, start_frame=10) as cache,
    ):
        cache.write(block)
    assert _files(tmp_path) == []


def test_unknown_suffix_lists_the_known(surface: Surface, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.xyz") as caught:
        open_cache(tmp_path / "a.xyz", surface, frames=1, rate=25)
    assert all(suffix in str(caught.value) for suffix in FORMATS)


@pytest.mark.parametrize(("frames", "rate", "word"), [(0, 25, "frames"), (3, 0, "rate"), (3, float("nan"), "rate")])
def test_refuses_timing(surface: Surface, tmp_path: Path, frames: int, rate: float, word: str) -> None:
    with pytest.raises(InputError, match=word):
        open_cache(tmp_path / "a.npz", surface, frames=frames, rate=rate)


def test_names_a_place_that_cannot_be_written(surface: Surface, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with (
        pytest.raises(InputError, match="cannot write"),
        open_cache(tmp_path / "file" / "a.npz", surface, frames=1, rate=25),
    ):
        pass


def test_needs_its_with_statement(surface: Surface, clip: np.ndarray, tmp_path: Path) -> None:
    with pytest.raises(WarpjldError, match="with statement"):
        open_cache(tmp_path / "a.npz", surface, frames=7, rate=25).write(clip)


@every_format
def test_two_processes_that_write_one_file_do_not_mix(
    export: Callable[[str], Cache],
    surface: Surface,
    clip: np.ndarray,
    tmp_path: Path,
    suffix: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if suffix.startswith(".usd"):
        pytest.importorskip("pxr")
    want = {path.name: path.read_bytes() for path in export(f"a{suffix}").files}
    how = {"frames": len(clip), "rate": 24.0, "start_frame": 3, "name": "hand"}
    one, other = (open_cache(tmp_path / f"a{suffix}", surface, **how) for _ in range(2))
    mine, parent = os.getpid(), os.getppid()
    with one:
        monkeypatch.setattr(os, "getpid", lambda: parent)  # a process that runs: its files are not swept
        with other:
            for start in (0, 4):
                some = clip[start : start + 4]
                monkeypatch.setattr(os, "getpid", lambda: mine)
                one.write(some[:, :, ::-1])
                monkeypatch.setattr(os, "getpid", lambda: parent)
                other.write(some)
        monkeypatch.setattr(os, "getpid", lambda: mine)
        assert {path.name: path.read_bytes() for path in other.files} == want
    assert sorted(want) == _files(tmp_path)
    assert {path.name: path.read_bytes() for path in one.files} != want


_FULL = """
import resource, signal, sys
from pathlib import Path
import numpy as np
from tests.finger import finger
from warpjld.errors import InputError
from warpjld.io.caches import open_cache

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
surface = finger().surface
clip = np.random.default_rng(0).normal(size=(250, len(surface.vertices), 3)).astype(np.float32)
path = Path(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
try:
    with open_cache(path, surface, frames=len(clip), rate=24) as cache:
        cache.write(clip)
except InputError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="sizes of files are limited as Linux does it")
@pytest.mark.parametrize("suffix", ["npz", "usdc", "usda", "pc2", "mdd", "obj", "glb"])
def test_a_full_disk_is_one_line_and_the_old_file_stays(tmp_path: Path, suffix: str) -> None:
    if suffix.startswith("usd"):
        pytest.importorskip("pxr")
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(b"the old one")
    done = subprocess.run([sys.executable, "-c", _FULL, str(path)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert len(done.stdout.splitlines()) == 1
    assert "cannot write" in done.stdout
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"the old one"
