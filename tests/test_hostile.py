"""Files that once crashed, hung, filled memory or lost results: each is refused in one line, and writes nothing.

The files are among the third-party assets; where these are missing, the tests of their readers make the like in code.
"""

from __future__ import annotations

import re
import shutil
import time
from pathlib import Path

import pytest

from warpjld.cli import main

_INSPECT = ("inspect", "FILE", "--no-picture")
_RUN = ("run", "FILE", "-o", "out")
_STUDY = ("study", "FILE", "-o", "out", "--check")
_MOVE = ("deform", "builtin:left", "--motion", "FILE", "-o", "out/x.npz")
_SURFACE = ("inspect", "surface.off", "--no-picture", "--skeleton", "FILE")
_OBJECT = ("run", "object.jld", "-o", "out")
REFUSED = {
    "segv.glb": (
        _INSPECT,
        r"segv\.glb: .*bufferViews\[0\]\.byteStride wants a whole number from 0 on, got -1000000000",
    ),
    "leak.glb": (_INSPECT, r"leak\.glb: .*bufferViews\[0\]\.byteStride wants a whole number from 0 on"),
    "count1e9.glb": (_INSPECT, r"count1e9\.glb: .*1,000,000,000 vertices; the limit is .*--limit vertices="),
    "index3e8.glb": (_INSPECT, r"index3e8\.glb: .*300,000,000 vertices; the limit is .*--limit vertices="),
    "empty_triangles.glb": (_INSPECT, r"empty_triangles\.glb: .*its face indices are no unsigned integers"),
    "degenerate.obj": (_OBJECT, r"object\.jld:1:10: degenerate\.obj: .*it has no triangle with an area"),
    "mesh-248.obj": (_OBJECT, r"object\.jld:1:10: mesh-248\.obj:1: want 3 numbers, got '0 0'"),
    "mesh-51.npz": (_OBJECT, r"object\.jld:1:10: mesh-51\.npz: .*vertices lie at 1e\+300: coordinates are read up to"),
    "lie.npz": (_OBJECT, r"object\.jld:1:10: lie\.npz: .*'vertices\.npy' is shorter than its header states"),
    "fan.jld": (_RUN, r"fan\.jld:1:9: there is no file 'inc/0\.jld'"),
    "laughs.jld": (_RUN, r"laughs\.jld:[0-9]+:1: 2,001 statements; the limit is .*--limit statements="),
    "double.jld": (_RUN, r"double\.jld:95:5: 16,384 characters; the limit is .*--limit text="),
    "nul.jld": (_RUN, r"nul\.jld:5:11: .*cannot stand in the name of a file"),
    "name.jld": (_RUN, r"name\.jld:1:40: the actor's name '\.\./\.\./x': '/' cannot stand in the name of a file"),
    "home.jld": (_RUN, r"home\.jld:1:6: there is no file '~nosuchuser/x\.glb'"),
    "coll.jld": ((*_RUN, "--check"), r"out/contact\.csv: would be written twice"),
    "late.jld": ((*_RUN, "--check"), r"late\.jld:12:1: 'x\.glb': 401 frames .*up to 300 frames"),
    "rate_gif.jld": (_RUN, r"rate_gif\.jld:5:1: 'f\.gif': rate: want 0\.002 to 1000 frames per second"),
    "rate_mp4.jld": (_RUN, r"rate_mp4\.jld:5:1: 'f\.mp4': rate: want 0\.01 to 1000 frames per second"),
    "fem-259.toml": (("fem", "FILE", "-o", "out"), r"fem-259\.toml: .*86,401,728 elements; the limit is .*elements="),
    "plan-48.toml": (_STUDY, r"plan-48\.toml: cannot be read as TOML: nested too deeply"),
    "plan-78.toml": (_STUDY, r"plan-78\.toml: cannot be read as TOML: a number of thousands of digits"),
    "bvh-76.bvh": (_MOVE, r"bvh-76\.bvh:186: want 'Frames:' and how many"),
    "bvh-90.bvh": (_MOVE, r"bvh-90\.bvh:186: want 'Frames:' and how many"),
    "csv-97.csv": (_MOVE, r"csv-97\.csv:1:2: no joint 'joint 9999"),
    "skel-17.json": (_SURFACE, r"skel-17\.json: joint 'left\.ring\.base': limits of flexion want .*1e\+30"),
    "skeleton.json": (
        ("inspect", "degenerate.obj", "--no-picture", "--skeleton", "FILE"),
        r"it has no triangle with an",
    ),
    "param-172.json": ((*_RUN[:1], "parameters.jld", *_RUN[2:]), r"param-172\.json"),
}
"""File → command, and what is said of it. ``math.toml`` is a study whose title was no picture's."""


@pytest.fixture
def here(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = data.parent / "faults" / "hostile"
    if not folder.is_dir():
        pytest.skip("the files (../shared/faults/hostile) are not here")
    shutil.copytree(folder, tmp_path / "files")
    monkeypatch.chdir(tmp_path / "files")
    monkeypatch.setenv("WARPJLD_LIMIT_STATEMENTS", "2000")  # so that it is reached soon
    surface = "OFF;4 4 0;0 0 -1;0 0 6;1 0 2;0 1 2;3 0 2 1;3 0 1 3;3 1 2 3;3 0 3 2"
    Path("surface.off").write_text(surface.replace(";", "\n"))
    return tmp_path / "files"


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused_in_one_line(here: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    hand = "HAND LEFT BUILTIN RESOLUTION 1500\n"
    Path("object.jld").write_text(f'OBJECT a "{name}"\nFRAMES 0 1\n')
    Path("parameters.jld").write_text(f'{hand}PARAMETERS "{name}"\nFRAMES 0 1\nEXPORT "e.npz"\n')
    if name == "coll.jld":  # a coarse hand will do
        Path(name).write_text(Path(name).read_text().replace("BUILTIN", "BUILTIN RESOLUTION 1500"))
    before, began = sorted(here.rglob("*")), time.process_time()
    arguments, message = REFUSED[name]
    with pytest.raises(SystemExit, match=r"^1$"):
        main([name if one == "FILE" else one for one in arguments])
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith("error: ")
    assert re.search(message, line), line
    assert sorted(here.rglob("*")) == before
    assert time.process_time() - began < 20.0


@pytest.mark.slow
def test_a_title_with_dollars_names_a_study(here: Path) -> None:
    main(["study", "math.toml", "-o", "out", "--quiet"])
    assert Path("out/summary.png").stat().st_size > 0
