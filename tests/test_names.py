"""Names that become files or labels, checked before any work."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.finger import finger
from warpjld.errors import InputError
from warpjld.fem.study.study_file import load_study
from warpjld.files.names import check_name, clash, expanded
from warpjld.files.overwriting import check_outputs
from warpjld.script import Interpreter, Scene
from warpjld.script.runner import run_scene

BAD = ["", " ", "..", "a/b", "a\\b", "/abs", "a\0b", "a\nb", "é" * 91, "a\udcff", "$5", "a:b", " a"]


@pytest.mark.parametrize("name", BAD)
def test_names_that_some_file_system_refuses(name: str) -> None:
    with pytest.raises(InputError, match="the name"):
        check_name(name, "the name")


@pytest.mark.parametrize("name", ["left", "Ring é", "手", "a.b-c", "step 1"])
def test_names_that_all_take(name: str) -> None:
    assert check_name(name, "the name") == name


def test_names_that_are_one_file_somewhere() -> None:
    assert clash(["a.png", "b.png", "A.PNG"]) == ("a.png", "A.PNG")
    assert clash(["\u00e9", "e\u0301"]) is not None
    assert clash(["a", "b"]) is None


def test_outputs_that_differ_in_case_only(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"written twice \(as a\.png and A\.png: not every"):
        check_outputs([tmp_path / "a.png", tmp_path / "A.png"], [])


def test_a_user_nobody_knows() -> None:
    assert expanded("~nosuchuser/x.glb") == Path("~nosuchuser/x.glb")


def _scene(tmp_path: Path, *lines: str) -> Scene:
    scene = Scene(folder=tmp_path, say=lambda line: None, warn=lambda line: None)
    scene.add("A", finger())
    Interpreter(scene).run_text("\n".join(lines))
    return scene


@pytest.mark.parametrize(
    "line", ['EXPORT "a\0b.npz"', f'EXPORT "{"x" * 300}.npz"', 'OBJECT "a/b" BALL 0.05', 'BODY "~nosuchuser/x.glb"']
)
def test_scripts_name_no_place_elsewhere(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="<script>:1:"):
        _scene(tmp_path, line)


def test_a_hyphen_that_makes_two_names_one(tmp_path: Path) -> None:
    scene = _scene(tmp_path, 'EXPORT "e-a.npz" A', "OBJECT B BALL 0.05", 'EXPORT "e.npz"')
    scene.add("B2", finger())
    with pytest.raises(InputError, match=r"e-a\.npz: would be written twice"):
        run_scene(scene, tmp_path / "out", dry=True)


def test_step_names_of_studies_stay_in_the_folder(tmp_path: Path) -> None:
    text = '[mesh]\nkind = "box"\ncounts = [1, 1, 1]\n[material.body]\nlaw = "linear"\nyoung = 1e6\npoisson = 0.3\n'
    path = tmp_path / "a.toml"
    for name, message in (("/tmp/x", "cannot stand in the name"), ("a/../../b", "cannot stand in the name")):
        path.write_text(f'{text}[[step]]\nname = "{name}"\n')
        with pytest.raises(InputError, match=message):
            load_study(path)
    path.write_text(f'{text}[[step]]\nname = "a b"\n[[step]]\nname = "A-B"\n')
    with pytest.raises(InputError, match="two are called"):
        load_study(path)
