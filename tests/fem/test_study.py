"""Study files and the command that runs them."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import pyvista
import trimesh

from warpjld.cli import main
from warpjld.errors import InputError
from warpjld.fem.study.study_file import load_study

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "inflate_ball.toml"
SMALL = """
[mesh]
kind = "box"
size = [1.0, 1.0, 2.0]
counts = [2, 2, 4]
[material.body]
law = "neo-hooke"
young = 1e5
poisson = 0.45
[sets.rim]
of = "z+"
above = { x = 0.9 }
[[step]]
name = "pull"
instants = 2
prescribed = [{ where = "z-", x = 0, y = 0, z = 0 }, { where = "z+", onto = { z = 2.4 } }]
[[step]]
name = "let go"
free = "refuse"
prescribed = [{ where = "z-", x = 0, y = 0, z = 0 }]
"""


def run(arguments: list[str]) -> int:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    return int(ended.value.code or 0)


def test_study_writes_a_series_and_reactions(tmp_path: Path) -> None:
    (tmp_path / "pull.toml").write_text(SMALL)
    assert run(["fem", str(tmp_path / "pull.toml"), "-o", str(tmp_path / "out"), "--no-pictures", "-q"]) == 0
    out = tmp_path / "out"
    reader = pyvista.get_reader(out / "pull.pvd")
    assert reader.time_values == [0.5, 1.0, 2.0]
    reader.set_active_time_value(1.0)
    grid = reader.read()[0]
    top = grid.points[:, 2] > 1.99
    np.testing.assert_allclose(grid.point_data["displacement"][top, 2], 0.4, atol=1e-9)
    assert grid.n_cells == 16
    assert {"displacement", "reaction", "mises"} <= set(grid.point_data)
    assert {"stress", "mises", "region"} <= set(grid.cell_data)
    rows = list(csv.DictReader((out / "reactions.csv").open()))
    full = {r["where"]: float(r["rz_newton"]) for r in rows if r["step"] == "pull" and r["load"] == "1.0"}
    assert full["z+"] == pytest.approx(-full["z-"], rel=1e-6)
    assert full["z+"] > 1e4
    last = [r for r in rows if r["step"] == "let go"]
    assert abs(float(last[-1]["rz_newton"])) < 1e-3
    assert not [p for p in out.iterdir() if "part" in p.name]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('kind = "box"', 'kind = "boxx"', r":3: mesh.kind: want one of box, .*'boxx'; did you mean box\?"),
        ("young = 1e5", "young = 0", ":8: material.body.young: want a modulus above 0"),
        ("poisson = 0.45", "poisson = 0.5", ":9: material.body.poisson: want −1 < ν < 0.5"),
        ("poisson = 0.45", "poison = 0.45", r":9: material.body.poison: unknown key; did you mean poisson\?"),
        ("[material.body]", "[material.bodi]", "no region 'bodi'; did you mean body"),
        ('law = "neo-hooke"', 'law = "neohooke"', "did you mean neo-hooke"),
        ("above = { x = 0.9 }", "above = { x = 9.0 }", r"\[sets.rim\] holds no node"),
        ('where = "z+"', 'where = "top"', "no node set 'top'"),
        ("counts = [2, 2, 4]", "counts = [2, 2, 0]", "counts: want three positive"),
        ("[[step]]", "[step]", "not TOML"),
        ("counts = [2, 2, 4]", 'counts = "many"', ":5: mesh.counts: want a finite number, got 'many'"),
        ("young = 1e5", 'young = "soft"', ":8: material.body.young: want a finite number, got 'soft'"),
        (
            "instants = 2",
            "centrifugal = { axle = [0, 0, 1] }",
            "centrifugal.axis: is missing",
        ),
        ("instants = 2", 'gravity = "down"', r":15: step\[0\].gravity: want 3 numbers, got 'down'"),
        ("instants = 2", "gravity = [0, 9.81]", r":15: step\[0\].gravity: want 3 numbers, got \[0, 9.81\]"),
        ("instants = 2", "instants = 0", r":15: step\[0\].instants: want a whole number from 1 on, got 0"),
        ("instants = 2", 'free = "held"', "free: want one of refuse, hold, got 'held'"),
        (
            "[material.body]",
            '[solver]\nmethod = "multigrd"\n[material.body]',
            "solver.method: .* did you mean multigrid",
        ),
        ('of = "z+"', 'off = "z+"', r":11: sets.rim.off: unknown key; did you mean of\?"),
        ("above = { x = 0.9 }", "above = { w = 0.9 }", "sets.rim.above.w: unknown key"),
        ("instants = 2", "force = { top = 3 }", "force.top: want 3 numbers, got 3"),
        ('{ where = "z+", onto = { z = 2.4 } }', '{ where = "z+" }', "is given no displacement"),
        ('name = "pull"', 'nam = "pull"', r":14: step\[0\].nam: unknown key; did you mean name\?"),
        ("instants = 2", "traction = { lid = [0, 0, 1] }", "traction on a missing face set"),
    ],
)
def test_wrong_study(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(SMALL.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load_study(path)
    assert caught.value.path == path


def test_a_set_named_twice_keeps_all_it_is_held_by(tmp_path: Path) -> None:
    twice = '{ where = "z+", x = 0.0 }, { where = "z+", onto = { z = 2.4 } }'
    (tmp_path / "twice.toml").write_text(SMALL.replace('{ where = "z+", onto = { z = 2.4 } }', twice))
    study = load_study(tmp_path / "twice.toml")
    held = next(study.run()).held["z+"]
    top = study.body.mesh.node_set("z+")
    np.testing.assert_array_equal(held, np.sort(np.concatenate([3 * top, 3 * top + 2])))


def test_missing_face_and_free_body_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(SMALL.replace('name = "let go"', 'name = "let go"\npressure = { lid = 3.0 }'))
    assert run(["fem", str(path), "-o", str(tmp_path / "out"), "--no-pictures", "-q"]) == 1
    assert "pressure on a missing face set" in capsys.readouterr().err
    path.write_text(SMALL.replace('prescribed = [{ where = "z-", x = 0, y = 0, z = 0 }]', ""))
    assert run(["fem", str(path), "-o", str(tmp_path / "out"), "--no-pictures", "-q"]) == 1
    assert "is not constrained: free are translation along x" in capsys.readouterr().err


def test_json_is_alone_on_stdout_and_holds_the_reactions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "pull.toml").write_text(SMALL)
    out = tmp_path / "out"
    assert run(["fem", str(tmp_path / "pull.toml"), "-o", str(out), "--no-pictures", "--json"]) == 0
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert "16 elements" in said.err
    assert (told["elements"], told["degrees_of_freedom"], told["converged"]) == (16, 135, True)
    rows = list(csv.DictReader((out / "reactions.csv").open()))
    assert [float(row["rz_newton"]) for row in rows] == [row["newton"][2] for row in told["reactions"]]
    assert {Path(file) for file in told["files"]} == set(out.iterdir())


def test_what_was_reached_is_told_before_a_step_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one_element = SMALL.replace("counts = [2, 2, 4]", "counts = [1, 1, 1]")
    (tmp_path / "crush.toml").write_text(one_element.replace("onto = { z = 2.4 }", "x = 0, y = 0, z = -3"))
    assert run(["fem", str(tmp_path / "crush.toml"), "-o", str(tmp_path / "out"), "--no-pictures", "--json"]) == 1
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert not told["converged"]
    assert told["message"] in said.err


def test_body_from_an_open_surface(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    surface = trimesh.creation.icosphere(3)
    surface.update_faces(surface.triangles_center[:, 2] < 0.93)
    surface.export(tmp_path / "cup.stl")
    text = SMALL.replace(
        'kind = "box"\nsize = [1.0, 1.0, 2.0]\ncounts = [2, 2, 4]', 'kind = "surface"\npath = "cup.stl"\nspacing = 0.25'
    )
    text = (
        text.split("[sets.rim]")[0]
        + """
[sets.foot]
below = { z = -0.7 }
[[step]]
gravity = [0, 0, -1.0]
prescribed = [{ where = "foot", x = 0, y = 0, z = 0 }]
"""
    )
    (tmp_path / "cup.toml").write_text(text)
    assert run(["fem", str(tmp_path / "cup.toml"), "-o", str(tmp_path / "out"), "--no-pictures"]) == 0
    printed = capsys.readouterr().out
    assert "the surface is not watertight" in printed
    assert "least scaled Jacobian" in printed


def test_example_loads() -> None:
    study = load_study(EXAMPLE)
    assert [step.name for step in study.steps] == ["inflate", "squeeze"]


@pytest.mark.slow
def test_example_runs_with_pictures(tmp_path: Path) -> None:
    assert run(["fem", str(EXAMPLE), "-o", str(tmp_path), "-q"]) == 0
    rows = list(csv.DictReader((tmp_path / "reactions.csv").open()))
    top = [float(r["rz_newton"]) for r in rows if r["where"] == "top"]
    assert all(a > b for a, b in zip([0.0, *top], top, strict=False))
    assert top[-1] == pytest.approx(-42.97, rel=1e-3)
    for name in ("inflate_displacement", "inflate_stress", "squeeze_displacement", "squeeze_stress"):
        assert (tmp_path / f"{name}.png").stat().st_size > 20_000
