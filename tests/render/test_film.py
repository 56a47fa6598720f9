from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from warpjld.errors import InputError, WarpjldError
from warpjld.render import Film


def _pictures(count: int, height: int = 49, width: int = 65) -> list[np.ndarray]:
    """A bright square that walks over a dark ground."""
    pictures = []
    for k in range(count):
        picture = np.full((height, width, 3), 30, np.uint8)
        picture[16:32, 4 * k : 4 * k + 16] = (220, 120, 60)
        pictures.append(picture)
    return pictures


def _decoded(path: Path) -> np.ndarray:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    reader = ffmpeg.read_frames(str(path))
    meta = next(reader)
    width, height = meta["size"]
    return np.stack([np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in reader])


@pytest.mark.parametrize("suffix", [".mp4", ".mkv", ".mov"])
def test_film_decodes_to_its_frames(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("imageio_ffmpeg")
    pictures = _pictures(11)
    with Film(tmp_path / f"a{suffix}", rate=12.5) as film:
        for picture in pictures:
            film.append(picture)
    decoded = _decoded(film.path)
    assert decoded.shape == (11, 50, 66, 3)  # even
    ground = decoded[:, 40:46, 2:60].mean(axis=(0, 1, 2))
    np.testing.assert_allclose(ground, 30, atol=1.5)
    np.testing.assert_allclose(decoded[2, 20:28, 12:20].mean(axis=(0, 1)), (220, 120, 60), atol=4)
    # lossy, and colour at half resolution
    assert np.abs(decoded[:, :49, :65].astype(int) - pictures).mean() < 4
    assert [p.name for p in tmp_path.iterdir()] == [film.path.name]


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_pillow_film(tmp_path: Path, suffix: str) -> None:
    pictures = _pictures(6)
    with Film(tmp_path / f"a{suffix}", rate=30) as film:
        for picture in pictures:
            film.append(picture)
    with Image.open(film.path) as image:
        assert image.n_frames == 6
        image.load()
        assert image.info["duration"] in (30, 33)
        image.seek(5)
        last = np.asarray(image.convert("RGB"))
    assert np.abs(last.astype(int) - pictures[5]).mean() < 4


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_exception_leaves_nothing(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("imageio_ffmpeg")
    film = Film(tmp_path / f"a{suffix}")

    def fail() -> None:
        with film:
            film.append(_pictures(1)[0])
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_refuses(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown kind of film '\.avi': want one of \.mp4"):
        Film(tmp_path / "a.avi")
    with pytest.raises(InputError, match="rate"):
        Film(tmp_path / "a.gif", rate=0)
    with pytest.raises(WarpjldError, match="with statement"):
        Film(tmp_path / "a.gif").append(_pictures(1)[0])
    with pytest.raises(InputError, match="at least one picture"), Film(tmp_path / "a.gif"):
        pass
    with Film(tmp_path / "a.gif") as film:
        film.append(_pictures(1)[0])
        with pytest.raises(InputError, match="size of the first"):
            film.append(_pictures(1, height=20)[0])
    assert film.frames == 1
    film.path.unlink()
    with pytest.raises(InputError, match="want uint8"), Film(tmp_path / "a.gif") as film:
        film.append(np.zeros((4, 4, 3)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_unwritable_folder_is_named_at_once(tmp_path: Path, suffix: str) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file.*cannot write"), Film(tmp_path / "file" / f"a{suffix}"):
        pass


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_read_only_folder(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="Permission denied"), Film(tmp_path / "a.gif"):
        pass


def test_missing_extra_is_named(tmp_path: Path) -> None:
    script = f"""
import sys
sys.modules["imageio_ffmpeg"] = None
from warpjld.errors import MissingExtraError
from warpjld.render import Film
try:
    Film({str(tmp_path / "a.mp4")!r}).__enter__()
except MissingExtraError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "warpjld[film]" in done.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("suffix", "rate"), [(".gif", 1e-7), (".gif", 1001.0), (".mp4", 0.009), (".webp", np.nan)])
def test_rates_that_no_film_has(tmp_path: Path, suffix: str, rate: float) -> None:
    with pytest.raises(InputError, match=r"a\..*: rate: want 0\.0.* to 1000 frames per second"):
        Film(tmp_path / f"a{suffix}", rate=rate)


def test_an_encoder_that_fails_leaves_the_old_film(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    program = tmp_path / "ffmpeg"
    program.write_text("#!/bin/sh\ncat > /dev/null\necho 'the encoder: no' >&2\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: str(program))
    path = tmp_path / "a.mp4"
    path.write_bytes(b"the old film")
    with pytest.raises(InputError, match="cannot write: the encoder: no"), Film(path, rate=25.0) as film:
        film.append(np.zeros((16, 16, 3), np.uint8))
    assert path.read_bytes() == b"the old film"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.mp4", "ffmpeg"]
