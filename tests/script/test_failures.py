"""One output that cannot be made takes none of the others with it; places are looked at before anything is computed."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from tests.finger import finger
from warpjld.errors import InputError, WarpjldError
from warpjld.files.whole_file import machine
from warpjld.io.caches.npz import NpzCache
from warpjld.script import Interpreter, Scene
from warpjld.script import making as module
from warpjld.script.runner import run_scene


def scene_of(tmp_path: Path, *lines: str) -> Scene:
    scene = Scene(folder=tmp_path, say=lambda line: None, warn=lambda line: None)
    scene.add("A", finger())
    Interpreter(scene).run_text("\n".join(("SIZE 64 48", "FRAMES 0 4", *lines)))
    return scene


def test_the_rest_is_published_and_the_failure_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: NpzCache, vertices: np.ndarray) -> None:
        if self.written == 2:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(NpzCache, "_append", full)
    scene = scene_of(tmp_path, 'EXPORT "a.npz"', 'EXPORT "a.mdd"', 'PICTURE 1 "p.png"', 'EXPORT_MOTION "a.bvh"')
    out = tmp_path / "out"
    with pytest.raises(WarpjldError, match=r"not made: 'a\.npz': .*No space left.*; all other outputs are in .*out"):
        run_scene(scene, out)
    assert sorted(file.name for file in out.iterdir()) == ["a.bvh", "a.mdd", "a.rest.obj", "p.png", "summary.json"]
    assert list(json.loads((out / "summary.json").read_text())["failed"]) == ["a.npz"]


def test_where_all_fail_the_folder_stays_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module, "draw_picture", refuse)
    with pytest.raises(WarpjldError, match=r"'p\.png': No space left"):
        run_scene(scene_of(tmp_path, 'PICTURE 1 "p.png"'), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("FRAMES 0 400", 'EXPORT "x.glb"'), r"<script>:4:1: 'x\.glb': 401 frames"),
        (("RATE 1e-7", 'FILM "f.gif"'), r"<script>:4:1: 'f\.gif': rate: want 0\.002 to 1000"),
        (("RATE 1e-7", 'FILM "f.mp4"'), r"<script>:4:1: 'f\.mp4': rate: want 0\.01 to 1000"),
    ],
)
def test_what_a_format_does_not_take_is_said_before(tmp_path: Path, lines: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        run_scene(scene_of(tmp_path, *lines), tmp_path / "out", dry=True)


def test_places_are_looked_at_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, out = scene_of(tmp_path, 'EXPORT "sub/a.npz"'), tmp_path / "out"
    (out / "sub" / "a.npz").mkdir(parents=True)
    with pytest.raises(InputError, match="a folder stands where this file should go"):
        run_scene(scene, out, dry=True)
    (out / "sub" / "a.npz").rmdir()
    (out / "sub").rmdir()
    (out / "sub").write_text("a file")
    with pytest.raises(InputError, match="sub: is a file"):
        run_scene(scene, out, dry=True)
    usage = type("Usage", (), {"free": 1000})
    monkeypatch.setattr("warpjld.script.destinations.shutil.disk_usage", lambda place: usage)
    with pytest.raises(InputError, match="kB are to be written, 1 kB are free"):
        run_scene(scene, tmp_path / "other", dry=True)


def test_a_device_that_is_not_there_is_said_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="device 'cuda:77' is not available"):
        run_scene(scene_of(tmp_path), tmp_path / "out", device="cuda:77", dry=True)


def test_hidden_folders_of_killed_runs_are_swept(tmp_path: Path) -> None:
    out = tmp_path / "out"
    dead, alive, other = (
        out / f".making{number}-{mark}-x"
        for number, mark in ((2**22 + 7, machine()), (os.getpid(), machine()), (2**22 + 7, "00000000"))
    )
    for place in (dead, alive, other):
        place.mkdir(parents=True)
    run_scene(scene_of(tmp_path, 'EXPORT "a.npz"'), out)
    assert [place.exists() for place in (dead, alive, other)] == [False, True, True]


def test_a_former_longer_sequence_is_replaced(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_scene(scene_of(tmp_path, 'EXPORT "a.obj"'), out)
    assert len(list(out.glob("a.*.obj"))) == 5
    run_scene(scene_of(tmp_path, "FRAMES 1 2", 'EXPORT "a.obj"'), out)
    assert sorted(file.name for file in out.glob("a.*.obj")) == ["a.0001.obj", "a.0002.obj"]
