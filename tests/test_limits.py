"""Limits: one table, raised by a flag or a variable, and a refusal that names both."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.finger import finger
from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.fem.study.study_file import load_study
from warpjld.files.array_file import read_arrays
from warpjld.files.input_file import open_input
from warpjld.files.nesting import nesting
from warpjld.files.text_file import read_json
from warpjld.geometry.lengths import LARGEST, SMALLEST, check_size
from warpjld.io import load_rig
from warpjld.io.mesh_file import read_mesh
from warpjld.limits import LIMITS, check_limit, limit, set_limit, variable
from warpjld.script import Interpreter, Scene
from warpjld.study.grasping import load_plan


@pytest.mark.parametrize("name", LIMITS)
def test_each_is_refused_by_name_and_raised_by_its_variable(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    most = LIMITS[name].most
    check_limit(name, most)
    with pytest.raises(InputError, match=rf"--limit {name}=… or WARPJLD_LIMIT_{name.replace('-', '_').upper()}"):
        check_limit(name, most + 1)
    with pytest.raises(InputError):
        check_limit(name, float("nan"))
    monkeypatch.setenv(variable(name), str(most + 1))
    check_limit(name, most + 1)


def test_what_is_no_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="there is no limit 'vertex'; did you mean vertices"):
        set_limit("vertex", "5")
    monkeypatch.setenv("WARPJLD_LIMIT_JOINTS", "many")
    with pytest.raises(InputError, match="WARPJLD_LIMIT_JOINTS: want a whole number above 0, got 'many'"):
        limit("joints")


def test_the_flag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_TRIALS", "1")  # so that it is put back
    plan = tmp_path / "plan.toml"
    plan.write_text('trials = 8\nseed = 1\n[[hands]]\nbuiltin = "right"\n[[objects]]\nbuiltin = "ball"\n')
    with pytest.raises(SystemExit, match="1"):
        main(["--limit", "trials=7", "study", str(plan), "--check"])
    assert "8 trials; the limit is 7" in capsys.readouterr().err
    assert os.environ["WARPJLD_LIMIT_TRIALS"] == "7"


def _run(text: str, tmp_path: Path) -> Scene:
    scene = Scene(folder=tmp_path, say=lambda line: None, warn=lambda line: None)
    Interpreter(scene).run_text(text)
    return scene


def test_macros_of_macros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_STATEMENTS", "2000")
    levels = "".join(f"MACRO M{k + 1}\n" + f"M{k}\n" * 10 + "END\n" for k in range(8))
    with pytest.raises(InputError, match=r"<script>:2:1: 2,001 statements; the limit is 2,000"):
        _run(f"MACRO M0\nPRINT\nEND\n{levels}M8\n", tmp_path)


def test_texts_that_double(tmp_path: Path) -> None:
    levels = "".join(f'MACRO T{k + 1} x\nT{k} "${{x}}${{x}}"\nEND\n' for k in range(30))
    with pytest.raises(InputError, match="16,384 characters; the limit is 10,000"):
        _run(f'MACRO T0 x\nPRINT "$x"\nEND\n{levels}T30 "a"\n', tmp_path)


def test_files_that_include_two_each(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_STATEMENTS", "2000")
    for k in range(25):
        (tmp_path / f"{k}.jld").write_text(f'INCLUDE "{k + 1}.jld"\nINCLUDE "{k + 1}.jld"\n')
    (tmp_path / "25.jld").write_text("PRINT\n")
    with pytest.raises(InputError, match="2,001 statements; the limit is 2,000"):
        Interpreter(Scene(folder=tmp_path, say=lambda line: None)).run_file(tmp_path / "0.jld")


def test_brackets(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="arithmetic: 201 levels; the limit is 200"):
        _run("RATE " + "(" + "1 + " * 400 + "1)", tmp_path)
    assert nesting(rb'{"a[[[": [1, [2]], "b\"[[": "\\[" }') == 3


@given(st.text(alphabet='[{]}"\\a').map(str.encode), st.integers(1, 7))
def test_nesting_does_not_depend_on_the_pieces_of_a_text(text: bytes, size: int) -> None:
    assert nesting(text[at : at + size] for at in range(0, len(text), size)) == nesting(text)


def test_a_mesh_of_hundred_thousand_layers(tmp_path: Path) -> None:
    path = tmp_path / "ball.toml"
    path.write_text(
        '[mesh]\nkind = "ball"\ninner = 0.5\nn = 12\nlayers = 100000\n'
        '[material.envelope]\nlaw = "linear"\nyoung = 1e6\npoisson = 0.3\n[[step]]\n'
    )
    with pytest.raises(InputError, match=r"ball\.toml: \[mesh\]: 86,401,728 elements; the limit is 2,000,000"):
        load_study(path)


@pytest.mark.parametrize("content", ["x = " + "[" * 5000, f"trials = {'9' * 5000}"], ids=["deep", "digits"])
def test_toml_that_python_does_not_take(tmp_path: Path, content: str) -> None:
    (tmp_path / "plan.toml").write_text(content)
    with pytest.raises(
        InputError, match=r"plan\.toml: cannot be read as TOML: (nested too deeply|a number of thousands)"
    ):
        load_plan(tmp_path / "plan.toml")


def test_huge_numbers_of_toml_are_cited_shortly(tmp_path: Path) -> None:
    (tmp_path / "plan.toml").write_text(f"trials = {'9' * 400}\n")
    with pytest.raises(InputError, match=r"plan\.toml:1: trials: want a whole number from 1 on, got inf"):
        load_plan(tmp_path / "plan.toml")


def test_an_archive_that_unpacks_to_gigabytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_UNPACKED_BYTES", "1000000")
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("vertices.npy", bytes(2_000_000))
    with pytest.raises(InputError, match=r"a\.npz: unpacked: 2,000,000 bytes; the limit is 1,000,000"):
        read_arrays(tmp_path / "a.npz")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_pipes_and_folders_are_no_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.glb")
    with pytest.raises(InputError, match="no regular file"):
        load_rig(tmp_path / "a.glb")
    with pytest.raises(InputError, match="is a folder"):
        open_input(tmp_path)
    with pytest.raises(InputError, match="no name of a file"):
        open_input("a\0b")


def test_lengths_that_are_not_computed_with() -> None:
    points = np.asarray(finger().surface.vertices)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    check_size(1.01 * points * SMALLEST / size, "it")
    check_size(0.9 * points * LARGEST / np.abs(points).max(), "it")
    with pytest.raises(InputError, match="at least 1e-05 m"):
        check_size(0.99 * points * SMALLEST / size, "it")
    with pytest.raises(InputError, match="at most 1e"):
        check_size(1.1 * points * LARGEST / np.abs(points).max(), "it")
    with pytest.raises(InputError):
        check_size(points * np.nan, "it")


@pytest.mark.parametrize("line", ["MOVE A 0 1e300 0 0", "PARAMETER ALL PALM 1e12", "RATE 1e-400", "OBJECT B BALL 1e-9"])
def test_huge_and_tiny_numbers_in_scripts(tmp_path: Path, line: str) -> None:
    scene = Scene(folder=tmp_path, warn=lambda line: None)
    scene.add("A", finger())
    with pytest.raises(InputError):
        Interpreter(scene).run_text(line)


def test_json_that_is_read_whole_is_limited_by_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WARPJLD_LIMIT_JSON_BYTES", "20")
    (tmp_path / "hand.json").write_text('{"frames": [[1, 2, 3]]}')
    with pytest.raises(InputError, match=r"hand\.json: JSON: 23 bytes; the limit is 20 "):
        read_json(tmp_path / "hand.json")


@pytest.mark.parametrize(
    ("name", "content"),
    {
        "a.msh": '(1 "meshio 5.3.5")\n(2 3)\n(3010 (1 1 8 1 3)(\n',  # ANSYS
        "a.nas": "GRID*   1\nBEGIN BULK\n$ Nastran file",
    }.items(),
)
def test_a_cut_mesh_on_which_meshio_reads_for_ever_is_refused(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=rf"{name}: cannot be read as {name[2:].upper()}: .*(ends before|reshape)"):
        read_mesh(tmp_path / name)


def test_readers_are_stopped_at_the_end_by_one_wrapper_however_many_files_a_process_reads() -> None:
    pytest.importorskip("meshio")
    code = (
        "import meshio; from warpjld.io.meshio_end import stop_at_end; stop_at_end(); once = meshio._files.open_file; "
        "stop_at_end(); assert meshio._files.open_file is once"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
