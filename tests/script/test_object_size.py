"""Objects in another unit than they were read in: told as they come on stage, refused where a hand is to take them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.grasp import load_object
from warpjld.grasp.hand_scale import doubt_of_size, hand_length
from warpjld.script import Interpreter, Scene


@pytest.fixture
def mug(tmp_path: Path) -> Path:
    """A mug 12 cm high, its numbers in centimetres."""
    path = tmp_path / "mug.obj"
    trimesh.creation.cylinder(4.0, 12.0).export(path)
    return path


def test_a_mug_in_centimetres_is_told(run, scene, mug: Path) -> None:
    told: list[str] = []
    scene.warn = told.append
    run(f'OBJECT mug "{mug}"')
    length = hand_length(scene.actor().skeleton)
    assert 0.15 < length < 0.22
    (line,) = told
    assert line.startswith(f"MUG measures 12 m, {12 / length:.3g} times the hand's {length:.3g} m")
    assert line.endswith("UNIT CM would make it 0.12 m, UNIT MM would make it 0.012 m")
    run(f'OBJECT right "{mug}" UNIT CM\nOBJECT other "{mug}" SCALE 0.01\nOBJECT wall BOX 10 4 0.1')
    assert scene.warnings == told == [line]
    run(f'OBJECT tiny "{mug}" UNIT CM SCALE 0.01')
    assert told[1].startswith("TINY measures 0.0012 m, 1/")
    assert told[1].endswith("UNIT M would make it 0.12 m")


def test_the_warning_goes_to_stderr_whatever_comes_first(mug: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = Scene()
    Interpreter(scene).run_text(f'OBJECT mug "{mug}"')
    out, err = capsys.readouterr()
    assert err.startswith("warning: MUG measures 12 m, 63.2 times a hand's usual 0.19 m: UNIT CM would make it 0.12 m")
    assert out == ""


@pytest.mark.parametrize(
    "line",
    [
        "GRASP 0 10 LEFT mug",
        "GRASP 0 10 LEFT mug INDEX THUMB COUPLING 1 1",
        "GRASP 0 10 LEFT mug AUTO TRIES 2",
        "AUTO_WRIST 5 LEFT PAD mug NEAREST",
        "AUTO_F_1 5 LEFT INDEX PAD mug NEAREST",
        "AUTO_F_2_3 5 LEFT INDEX KNUCKLES2 PAD mug 3",
    ],
)
def test_no_hand_takes_it(run, scene, mug: Path, line: str) -> None:
    run(f'OBJECT mug "{mug}"')
    with pytest.raises(InputError, match=r"MUG measures 12 m, 6\d.* UNIT CM would make it 0.12 m.*say UNIT M$"):
        run(line)
    assert not scene.attempts


def test_a_stated_unit_is_meant(run, scene, mug: Path) -> None:
    run(f'OBJECT mug "{mug}" UNIT M\nAUTO_F_1 5 LEFT INDEX PAD mug NEAREST')
    assert len(scene.warnings) == 1
    assert len(scene.attempts) == 1


@pytest.mark.parametrize(("size", "odd"), [(0.0039, False), (0.0037, True), (3.7, False), (3.9, True)])
def test_from_a_fiftieth_to_twenty_times_a_hand(tmp_path: Path, size: float, odd: bool) -> None:
    trimesh.creation.box((size, size / 2, size / 3)).export(tmp_path / "a.stl")
    thing = load_object(tmp_path / "a.stl")
    np.testing.assert_allclose(thing.size.max(), size, rtol=1e-5)
    assert (doubt_of_size(thing, 0.19, "m") is not None) == odd
