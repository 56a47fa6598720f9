"""Pages that play by themselves."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.page.recording import PageRecording
from warpjld.script.run_script import run_script

pytest.importorskip("viser", reason="viser is not installed")
msgspec = pytest.importorskip("msgspec")
zstandard = pytest.importorskip("zstandard")

VERTICES = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], np.int32)


def recorded(path: Path) -> tuple[float, list[tuple[float, dict]], list[bytes]]:
    """Seconds, messages with their times, and arrays of a page, read by the recording's format and not by viser."""
    (data,) = re.findall(r'__VISER_EMBED_DATA__="([^"]+)"', path.read_text(encoding="utf-8"))
    raw = base64.b64decode(data)
    plain = zstandard.ZstdDecompressor().decompressobj().decompress(raw[8:])
    length = int.from_bytes(plain[:8], "little")
    content = msgspec.msgpack.decode(plain[8 : 8 + length])
    arrays, at = [], 8 + length
    for size in content["binaryBufferLengths"]:
        at += -at % 8
        arrays.append(plain[at : at + size])
        at += size
    return content["durationSeconds"], content["messages"], arrays


def test_a_page_holds_every_frame_at_its_time(tmp_path: Path) -> None:
    with PageRecording(tmp_path / "a.html", rate=20) as page:
        for frame in range(5):
            page.surface("skin", VERTICES + 0.01 * min(frame, 3), FACES, "#ff0000")
            page.step()
    seconds, messages, arrays = recorded(tmp_path / "a.html")
    assert seconds == pytest.approx(0.25)
    moved = [
        (time, m["updates"]["vertices"]["__binary_index"]) for time, m in messages if "vertices" in m.get("updates", {})
    ]
    assert [round(time, 6) for time, _ in moved] == [0.05, 0.1, 0.15]  # the last frame is as the one before
    for frame, (_, index) in enumerate(moved, start=1):
        places = np.frombuffer(arrays[index], np.float32).reshape(-1, 3)
        assert np.abs(places - VERTICES - 0.01 * frame).max() <= 2.0**-18 + 1e-9


def test_colours_of_vertices_change_with_the_frames(tmp_path: Path) -> None:
    with PageRecording(tmp_path / "a.html", rate=20) as page:
        for frame in range(3):
            page.colored("skin", VERTICES, FACES, np.full((4, 3), 50 * frame, np.uint8))
            page.step()
    _, messages, _ = recorded(tmp_path / "a.html")
    assert [round(time, 6) for time, m in messages if "glb_data" in m.get("props", {})] == [0, 0.05, 0.1]


def test_an_empty_page_is_refused_and_an_error_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at least one frame"), PageRecording(tmp_path / "a.html"):
        pass

    def broken() -> None:
        with PageRecording(tmp_path / "a.html") as page:
            page.surface("skin", VERTICES, FACES, "#ff0000")
            page.step()
            raise KeyError

    with pytest.raises(KeyError):
        broken()
    assert list(tmp_path.iterdir()) == []


def test_scripts_make_pages_as_films_and_by_option(hands, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("warpjld.hand.kept.kept_hand", lambda side, **options: hands[side])
    script = tmp_path / "wave.jld"
    script.write_text(
        "HAND LEFT BUILTIN\nOBJECT APPLE BALL 0.05 AT 0 0.1 0\nJOINT left.index.base FLEXION AT 0 0\n"
        'JOINT left.index.base FLEXION AT 3 60\nFILM "wires.html" WIREFRAME\n'
    )
    summary = run_script(script, tmp_path / "out", page=True, say=lambda line: None)
    assert [one["name"] for one in summary["files"]] == ["wave.html", "wires.html"]
    for name in ("wave.html", "wires.html"):
        seconds, messages, _ = recorded(tmp_path / "out" / name)
        assert seconds == pytest.approx(4 / 30)
        names = {m["name"] for _, m in messages if "faces" in m.get("props", {})}
        assert names == {"/skin", "/objects/APPLE"}
        assert sum("vertices" in m.get("updates", {}) for _, m in messages) == 3


@pytest.mark.slow
def test_the_fist_is_a_page_below_10_megabytes(tmp_path: Path) -> None:
    script = tmp_path / "fist.jld"
    examples = Path(__file__).resolve().parents[2] / "examples"
    script.write_text((examples / "fist.jld").read_text() + 'FILM "fist.html"\n')
    run_script(script, tmp_path / "out", say=lambda line: None)
    page = tmp_path / "out" / "fist.html"
    assert page.stat().st_size < 10e6
    assert recorded(page)[0] == pytest.approx(2.0)
