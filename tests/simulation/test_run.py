"""A finger pressed on a plate from a script: forces, tables, pictures, going on, and what cannot work."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import SolveStatus
from warpjld.grasp import Places
from warpjld.rig import Rig
from warpjld.script import Scene
from warpjld.script.contact import SceneAnimation, run_contact
from warpjld.script.runner import run_scene
from warpjld.simulation.bodies.free_object import settle_free_object
from warpjld.simulation.solve.checkpoint import load_checkpoint
from warpjld.simulation.solve.start_frame import find_start

PLATE = """
OBJECT plate BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165
MOVE LEFT 0  0  0.001 0
MOVE LEFT 10 0 -0.008 0
FLESH LEFT INDEX ELEMENT 0.004
FRAMES 0 8
"""


@pytest.fixture(scope="module")
def pressed(fine: Rig, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """The script made once: its folder and its summary."""
    from warpjld.script import Interpreter

    scene = Scene(say=lambda text: None)
    scene.add("left", fine)
    Interpreter(scene).run_text(
        PLATE + "PRESS 0 8 EVERY 2 STATE 'state.npz'\nSIZE 160 120\nPICTURE 8 'a.png' PRESSURE LEFT\n"
        "PICTURE 8 'b.png' PRESSURE\nPICTURE 8 'd.png' PRESSURE LEFT INDEX\n"
        "PICTURE 8 'c.png' SHADED\nTABLE 't.csv'\nTABLE 't.parquet'\nVOLUME 'v.pvd'\n"
        "EXPORT 'e.npz'"
    )
    out = tmp_path_factory.mktemp("plate")
    return out, run_scene(scene, out)


def test_a_finger_presses_harder_and_harder(pressed: tuple[Path, dict]) -> None:
    out, summary = pressed
    assert summary["press"]["status"] == "CONVERGED"
    assert summary["press"]["verdict"].startswith("realistic: muscles do at most")
    with (out / "t.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["digit"] == "index"]
    force = [float(row["force_n"]) for row in rows]
    area = [float(row["area_mm2"]) for row in rows]
    assert (np.diff(force) > 0).all()
    assert (np.diff(area) >= 0).all()
    assert 0.2 < force[-1] < 20.0
    assert float(rows[-1]["fy_n"]) > 0.9 * force[-1]
    assert float(rows[-1]["bone_n"]) == pytest.approx(force[-1], rel=1e-3)
    assert float(rows[-1]["share"]) >= force[-1] / float(rows[-1]["limit_n"]) - 1e-6
    assert {row["against"] for row in rows} == {"PLATE"}
    # force is pressure times area, as far as the highest pressure tells
    assert float(rows[-1]["peak_kpa"]) * area[-1] * 1e-3 > force[-1]


def test_everything_asked_for_is_made(pressed: tuple[Path, dict]) -> None:
    import pyarrow.parquet

    out, summary = pressed
    names = {file["name"] for file in summary["files"]}
    assert {"a.png", "b.png", "c.png", "d.png", "t.csv", "t.parquet", "v.pvd"} <= names
    table = pyarrow.parquet.read_table(out / "t.parquet").to_pylist()
    assert table[-1]["frame"] == 8
    assert json.loads((out / "summary.json").read_text())["press"]["digits"]
    assert not list(out.glob("*.part"))


def test_the_skin_stays_out_of_the_plate(pressed: tuple[Path, dict]) -> None:
    out, _ = pressed
    with np.load(out / "e-left.npz" if (out / "e-left.npz").is_file() else out / "e.npz") as file:
        vertices = file["vertices"]
    top = -0.0245
    over = (np.abs(vertices[-1, :, 0] - 0.034) < 0.017) & (np.abs(vertices[-1, :, 2] + 0.165) < 0.017)
    assert (vertices[-1, over, 1] < top + 2e-4).sum() > 20  # it lies on the plate
    assert vertices[-1, over, 1].min() > top - 1e-6


@pytest.mark.slow
def test_a_finished_state_is_gone_on_from(pressed: tuple[Path, dict], fine: Rig, tmp_path: Path) -> None:
    import shutil

    from warpjld.script import Interpreter

    out, _ = pressed
    shutil.copy(out / "state.npz", tmp_path / "state.npz")
    scene = Scene(say=lambda text: None)
    scene.add("left", fine)
    Interpreter(scene).run_text(PLATE + "PRESS 0 8 EVERY 2 STATE 'state.npz'")
    again = run_contact(scene, tmp_path)
    assert again.solved.resumed == len(again.solved.frames)
    with (out / "t.csv").open(encoding="utf-8") as file:
        force = [float(row["force_n"]) for row in csv.DictReader(file) if row["digit"] == "index"]
    np.testing.assert_allclose([r.force_n for r in again.rows if r.digit == "index"], force, rtol=1e-5)
    scene = Scene(say=lambda text: None)
    scene.add("left", fine)
    Interpreter(scene).run_text(PLATE + "PRESS 0 7 EVERY 2 STATE 'state.npz'")
    with pytest.raises(InputError, match=r"state.npz: this state belongs to another scene: frames"):
        run_contact(scene, tmp_path)


def test_what_is_no_state_is_refused(tmp_path: Path) -> None:
    (tmp_path / "state.npz").write_text("nonsense")
    with pytest.raises(InputError, match="cannot be read as a state of a contact solve"):
        load_checkpoint(tmp_path / "state.npz")


def test_solving_begins_before_the_first_touch(run: Callable[[str], Scene]) -> None:
    scene = run(PLATE + "PRESS 0 8")
    found = find_start(SceneAnimation(scene), scene.contact, scene.contact.pressing)
    assert 1 <= found.start <= 5
    far = run("OBJECT moon BALL 0.02 AT 1 0 0\nPHYSICAL moon")
    assert find_start(SceneAnimation(far), far.contact, far.contact.pressing).start == found.start


@pytest.mark.slow
def test_bones_in_a_rigid_object_are_named(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(
        "OBJECT plate BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165\nMOVE LEFT 0 0 0.002 0\nMOVE LEFT 2 0 -0.016 0\n"
        "FLESH LEFT INDEX\nPRESS 0 2 EVERY 2"
    )
    report = run_contact(scene, tmp_path)
    assert report.solved.status is not SolveStatus.CONVERGED
    assert "mm inside PLATE, which cannot give way" in report.verdict.text


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "OBJECT pea BALL 0.006 AT 0 0 -0.06\nPHYSICAL pea\nFLESH LEFT ELEMENT 0.004",
            r"PEA lies inside LEFT: nothing can press it out",
        ),
        (
            "OBJECT a BOX 0.02 0.02 0.02 AT 1 0 0\nOBJECT b BOX 0.02 0.02 0.02 AT 1 0.05 0\n"
            "PHYSICAL a\nPHYSICAL b\nBOND a b 1e4",
            r"<script>:5:1: a bond to nothing: A and B are 30 mm apart",
        ),
        (
            "OBJECT a BOX 0.02 0.02 0.02\nPHYSICAL a\nPOINTS a p NEAR 5 5 5 0.01\nVECTOR a p AT 0 0 0 0",
            r"<script>:2:1: A: points P: no point of the object lies there",
        ),
        ("OBJECT a GLASS\nPHYSICAL a ELEMENT 0.01", r"<script>:2:1: A: "),
        pytest.param(
            "MOVE LEFT 0 0 0 0\nFLESH left INDEX ELEMENT 0.05",
            r"<script>:2:1: FLESH LEFT: ELEMENT: 0.05 m is too coarse",
            marks=pytest.mark.slow,  # five sizes are tried
        ),
        ("FLESH left INDEX ELEMENT 0.00005", r"<script>:1:1: FLESH LEFT: ELEMENT: 5e-05 m would make a grid of"),
    ],
)
def test_hopeless_scenes_are_refused(run: Callable[[str], Scene], tmp_path: Path, lines: str, message: str) -> None:
    scene = run(lines + "\nPRESS 0 4")
    with pytest.raises(InputError, match=message):
        run_contact(scene, tmp_path)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("PICTURE 0 'a.png' PRESSURE", r"<script>:1:1: 'a.png' shows contact, but none is solved"),
        ("TABLE 't.csv'", r"<script>:1:1: 't.csv' shows contact, but none is solved"),
        (
            "FLESH left\nPRESS 2 6\nPICTURE 9 'a.png' PRESSURE",
            r"<script>:3:1: 'a.png' shows pressure at frame 9, but PRESS solves frames 2 to 6",
        ),
        (
            "OBJECT a BALL 0.06\nPHYSICAL a\nPRESS 2 6\nTACTILE 't.csv'",
            r"<script>:4:1: 't.csv' shows what skin feels, but no actor has flesh",
        ),
        (
            "OBJECT a BALL 0.06\nPHYSICAL a\nPRESS 2 6\nTACTILE 't.csv' LEFT",
            r"<script>:4:1: 't.csv' shows what LEFT feels, but it has no flesh: FLESH LEFT makes it so",
        ),
        ("FRAMES 0 4\nFLESH left\nPRESS 10 20", r"<script>:3:1: PRESS solves frames 10 to 20, but 0 to 4 are made"),
    ],
)
def test_what_cannot_be_shown_is_refused_before_anything_is_solved(
    run: Callable[[str], Scene], tmp_path: Path, lines: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        run_scene(run(lines), tmp_path, dry=True)


def test_frames_solved_but_not_made_are_noted(run: Callable[[str], Scene], tmp_path: Path) -> None:
    summary = run_scene(run("FRAMES 0 4\nFLESH left\nPRESS 2 20"), tmp_path, dry=True)
    assert "PRESS solves frames 2 to 20, of which those after 4 are not made: see FRAMES" in summary["notes"]


def test_a_free_ball_settles_between_what_closes_on_it() -> None:
    from warpjld.fem.contact.obstacles.solids import Plane
    from warpjld.grasp.shapes import ball

    thing = ball(0.02)
    at = Places.of((0.0, 0.0095, 0.0)).apply(thing.vertices)[0]
    ground = Plane()
    lifted = settle_free_object(at, thing.faces, np.empty((0, 3)), [ground], 0.0)
    assert ground.project(lifted.of(at), 0.0).distance.min() > -1e-6
    assert lifted.overlap < 1e-6
    assert np.abs(lifted.shift[[0, 2]]).max() < 1e-6
    # a point pushes from one side: the ball goes; a point on either side: it stays in the middle, held
    pushed = settle_free_object(at, thing.faces, np.array([[0.009, 0.0095, 0.0]]), [], 0.0)
    assert pushed.overlap < 1e-5
    assert pushed.shift[0] == pytest.approx(-0.001, rel=0.05)
    walls = [Plane((-0.0095, 0.0, 0.0), (1.0, 0.0, 0.0)), Plane((0.009, 0.0, 0.0), (-1.0, 0.0, 0.0))]
    held = settle_free_object(at, thing.faces, np.empty((0, 3)), walls, 0.0)
    assert held.shift[0] == pytest.approx(-0.00025, rel=0.1)
    assert held.overlap == pytest.approx(0.00075, rel=0.05)


PINCHED = """
SPLINE 1
FINGER1  LEFT INDEX FLEXION   AT 0 0
FINGER23 LEFT INDEX KNUCKLES2 AT 0 0
FINGER23 LEFT INDEX KNUCKLES3 AT 0 0
FINGER1  LEFT THUMB FLEXION   AT 0 0
FINGER1  LEFT THUMB PIVOT     AT 0 0
FINGER23 LEFT THUMB KNUCKLES2 AT 0 0
FINGER23 LEFT THUMB KNUCKLES3 AT 0 0
FINGER1  LEFT INDEX FLEXION   AT 20 40.5
FINGER23 LEFT INDEX KNUCKLES2 AT 20 53.1
FINGER23 LEFT INDEX KNUCKLES3 AT 20 30.5
FINGER1  LEFT THUMB FLEXION   AT 20 14.3
FINGER1  LEFT THUMB PIVOT     AT 20 5.9
FINGER23 LEFT THUMB KNUCKLES2 AT 20 30.3
FINGER23 LEFT THUMB KNUCKLES3 AT 20 24.6
"""


@pytest.mark.parametrize(
    ("flesh", "meets"), [("THUMB INDEX", True), ("THUMB INDEX ITSELF OFF", False), ("INDEX", False)]
)
def test_a_pinch_is_solved_from_where_skin_meets_skin(run: Callable[[str], Scene], flesh: str, meets: bool) -> None:
    scene = run(PINCHED + f"FLESH LEFT {flesh}\nPRESS 0 20\n")
    assert scene.contact.pressing is not None
    start = find_start(SceneAnimation(scene), scene.contact, scene.contact.pressing).start
    assert start == (pytest.approx(16.0, abs=2.0) if meets else 19.0)
