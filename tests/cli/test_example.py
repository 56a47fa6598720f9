"""``warpjld example``: the examples that come with the package."""

import json
from pathlib import Path

import pytest

from warpjld.cli import main
from warpjld.cli.example import example_files

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["example", *arguments])
    return int(ended.value.code or 0)


def test_they_are_listed_with_what_they_show(capsys) -> None:
    assert run() == 0
    told = capsys.readouterr().out
    assert "fist " in told
    assert "closes into a fist" in told
    assert run("--json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert listed.keys() == example_files().keys()
    assert all(len(one["shows"]) > 20 for one in listed.values())


def test_every_file_of_the_folder_is_one_or_belongs_to_one() -> None:
    names = {file.name for file in example_files().values()}
    there = {file.name for file in (ROOT / "examples").iterdir() if file.is_file()}
    assert there - names == {"user_command.py", "grasp_objects.toml", "grasp_real_objects.toml"}


def test_the_wheel_holds_them() -> None:
    import tomllib

    build = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
    assert build["targets"]["wheel"]["force-include"] == {"examples": "warpjld/examples"}


def test_a_script_runs(tmp_path, monkeypatch, quick_hands) -> None:
    from warpjld.cli import example

    script = tmp_path / "fist.jld"
    script.write_text("HAND LEFT BUILTIN RESOLUTION 1500\nFINGER1 LEFT INDEX FLEXION AT 0 60\nEXPORT 'a.npz'\n")
    monkeypatch.setattr(example, "examples_folder", lambda: tmp_path)
    assert run("fist", "-q", "-o", str(tmp_path / "out")) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"a.npz", "summary.json"}
    assert run("fist", "more", "-o", str(tmp_path / "out")) == 1


def test_a_program_runs_in_the_output_folder(tmp_path, monkeypatch) -> None:
    from warpjld.cli import example

    (tmp_path / "tell.py").write_text('"""Tells."""\nimport sys\nopen("told.txt", "w").write(sys.argv[1])\n')
    (tmp_path / "fails.py").write_text('"""Fails."""\nraise SystemExit(3)\n')
    monkeypatch.setattr(example, "examples_folder", lambda: tmp_path)
    assert run("tell", "hello", "-o", str(tmp_path / "out")) == 0
    assert (tmp_path / "out" / "told.txt").read_text() == "hello"
    assert run("fails", "-o", str(tmp_path / "out")) == 1


def test_files_are_copied_and_none_is_taken_the_place_of(tmp_path, capsys) -> None:
    assert run("user_command", "--copy", "-o", str(tmp_path)) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"user_command.jld", "user_command.py"}
    assert run("user_command", "--copy", "-o", str(tmp_path)) == 1
    assert "exists already" in capsys.readouterr().err


def test_a_misspelt_name(capsys) -> None:
    assert run("fists") == 1
    assert "did you mean fist?" in capsys.readouterr().err
