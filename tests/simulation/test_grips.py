"""Grips from scripts: a finger that presses with a wished force, is corrected, and feels; balls too heavy to lift."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem import SolveStatus
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.script.runner import run_scene
from warpjld.simulation.simulate import Simulation

PLATE = """
OBJECT plate BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165
SPLINE 1
GRASP 0 4 LEFT plate INDEX
FLESH LEFT INDEX ELEMENT 0.003
FRICTION 0.5
FRAMES 0 8
"""

FORCE = PLATE.replace("0.003", "0.004") + "SQUEEZE 5 8 LEFT FORCE 0.6\n"

BALL = """
OBJECT BALL BALL 0.024 AT 0.0411 -0.0568 -0.088
FINGER1  LEFT INDEX FLEXION    AT 0 70
FINGER23 LEFT INDEX KNUCKLES2  AT 0 40
FINGER23 LEFT INDEX KNUCKLES3  AT 0 20
FINGER1  LEFT THUMB ABDUCTION  AT 0 8
FINGER1  LEFT THUMB FLEXION    AT 0 -15
PHYSICAL BALL YOUNG 200000 POISSON 0.45 ELEMENT 0.004
FLESH LEFT THUMB INDEX ELEMENT 0.003 ITSELF OFF
SPLINE 1
GRASP 0 10 LEFT BALL THUMB COUPLING 1 0.6
SQUEEZE 10 15 LEFT 2
"""


@pytest.fixture(scope="module")
def pressed(rig, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict, Scene]:
    """A finger presses a plate with 0.6 N: the script made once."""
    scene = Scene(say=lambda text: None)
    scene.add("left", rig)
    Interpreter(scene).run_text(
        FORCE + "PRESS 2 8\nSIZE 160 120\nPICTURE 8 'a.png'\n"
        "TACTILE 'touch.csv'\nTACTILE 'touch.png' LEFT\nTACTILE 'touch.parquet'"
    )
    out = tmp_path_factory.mktemp("force")
    return out, run_scene(scene, out), scene


def test_a_finger_presses_with_the_force_asked_for(pressed: tuple[Path, dict, Scene]) -> None:
    out, summary, scene = pressed
    (found,) = summary["press"]["searches"]
    assert found["status"] == "REACHED"
    assert found["force_n"] == pytest.approx(0.6, rel=0.02)
    assert list(found["digits"]) == ["left.index"]
    assert "0.6 N asked for" in summary["press"]["grips"][0]
    rows = [row for row in csv.DictReader((out / "contact.csv").open(encoding="utf-8")) if row["digit"] == "index"]
    assert float(rows[-1]["force_n"]) == pytest.approx(0.6, rel=0.05)  # on another way: friction remembers
    tried = list(csv.DictReader((out / "grips.csv").open(encoding="utf-8")))
    assert sum(int(row["chosen"]) for row in tried) == 1
    # the angle that was found is a key now
    motion = scene.actor("left").motion
    by = motion.value("left.index.base.flexion", 8.0) - motion.value("left.index.base.flexion", 5.0)
    assert math.degrees(float(by)) == pytest.approx(found["grip_degrees"], abs=1e-3)
    assert float(by) > 0.0


def test_the_pad_feels_what_the_plate_bears(pressed: tuple[Path, dict, Scene]) -> None:
    out, _, _ = pressed
    rows = [r for r in csv.DictReader((out / "touch.csv").open(encoding="utf-8")) if r["pad"] == "left.index.distal"]
    force = np.array([float(row["normal_force"]) for row in rows])
    assert len(rows) >= 4
    assert (np.diff(force) >= 0.0).all()
    assert force[-1] == pytest.approx(0.6, rel=0.1)
    assert float(rows[-1]["force_y"]) == pytest.approx(0.6, rel=0.1)
    centre = [float(rows[-1][f"centre_{axis}"]) for axis in "xyz"]
    np.testing.assert_allclose(centre, [0.034, -0.0245, -0.168], atol=6e-3)
    assert float(rows[-1]["slip"]) >= 0.0
    assert 0.0 <= float(rows[-1]["sticking"]) <= 1.0
    assert (out / "touch.png").stat().st_size > 1e4
    assert (out / "touch.parquet").is_file()
    assert "N" in json.dumps(json.loads((out / "touch.columns.json").read_text(encoding="utf-8")))


def solved(scene: Scene, out: Path) -> Simulation:
    report = run_contact(scene, out)
    assert report.solved.status is SolveStatus.CONVERGED, report.verdict.text
    return report


@pytest.mark.slow
def test_a_force_beyond_the_muscles_is_unreachable(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(PLATE + "STRENGTH LEFT INDEX 0.5\nSQUEEZE 5 8 LEFT FORCE 4 INDEX MOST 6\nPRESS 2 8")
    report = solved(scene, tmp_path)
    (found,) = report.grips
    assert found.status == "TOO_WEAK"
    assert "unreachable: more force would be needed than the muscles have; 4 N asked for" in found.text
    assert found.force <= 0.5
    assert max(row.share for row in report.rows if row.digit == "index") <= 1.05


@pytest.mark.slow
def test_two_fingers_share_a_force_as_their_muscles_do(run: Callable[[str], Scene], tmp_path: Path) -> None:
    """The middle finger, of which little is asked by its strength, presses little, whoever touched first."""
    wide = PLATE.replace("BOX 0.036", "BOX 0.09").replace("AT 0.034", "AT 0.02").replace("INDEX", "INDEX MIDDLE")
    scene = run(wide + "STRENGTH LEFT MIDDLE 20\nSQUEEZE 5 8 LEFT FORCE 2 SHARED BY MUSCLES\nPRESS 2 8 EVERY 3")
    report = solved(scene, tmp_path)
    (found,) = report.grips
    assert found.status == "REACHED", found.text
    assert found.force == pytest.approx(2.0, rel=0.02)
    last = {row.digit: row for row in report.rows if row.frame == 8.0 and row.digit in ("index", "middle")}
    assert last["index"].share == pytest.approx(last["middle"].share, rel=0.1)
    assert last["index"].bone_n > 2.0 * last["middle"].bone_n  # 59 N and 20 N
    assert sum(row.bone_n for row in last.values()) == pytest.approx(2.0, rel=0.05)
    assert len({trial["grip_deg"] for trial in found.rows if trial["chosen"]}) == 2


@pytest.mark.slow
def test_a_force_beyond_the_range_of_motion_is_unreachable(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(PLATE + "SQUEEZE 5 8 LEFT FORCE 40 MOST 0.5\nPRESS 2 8 EVERY 3")
    (found,) = solved(scene, tmp_path).grips
    assert found.status == "LIMIT"
    assert "bent as far as they may; 40 N asked for" in found.text
    assert math.degrees(found.grip) == pytest.approx(0.5)


@pytest.mark.slow
def test_digits_that_bear_too_much_are_opened(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(PLATE + "STRENGTH LEFT INDEX 1\nSQUEEZE 5 8 LEFT 2.5\nPRESS 2 8 CORRECT")
    wanted = float(scene.actor("left").motion.value("left.index.base.flexion", 8.0))
    report = solved(scene, tmp_path)
    last = next(row for row in report.rows if row.frame == 8.0 and row.digit == "index")
    assert 0.9 <= last.share <= 1.0
    assert max(row.share for row in report.rows if row.digit == "index") <= 1.0
    assert float(scene.actor("left").motion.value("left.index.base.flexion", 8.0)) < wanted
    (line,) = report.verdict.corrections
    assert "LEFT index" in line
    assert "of 1 N at frame" in line
    assert "opened base by" in line


@pytest.mark.slow
def test_a_digit_of_which_one_joint_has_keys_is_opened(run: Callable[[str], Scene], tmp_path: Path) -> None:
    """It ended in a KeyError: the digit's other joints have no keys."""
    closing = "FINGER1 LEFT INDEX FLEXION AT 0 0\nFINGER1 LEFT INDEX FLEXION AT 8 6\n"
    scene = run(
        PLATE.replace("GRASP 0 4 LEFT plate INDEX\n", "")
        + closing
        + "STRENGTH LEFT INDEX 0.5\nPRESS 0 8 EVERY 2 CORRECT"
    )
    report = solved(scene, tmp_path)
    assert report.verdict.corrections
    assert "opened base by" in report.verdict.corrections[0]
    assert "left.index.knuckle2.flexion" not in scene.actor("left").motion.tracks
    assert max(row.share for row in report.rows if row.digit == "index") <= 1.0


@pytest.mark.slow
def test_corrections_are_kept_in_a_state_and_gone_on_from(fine: Rig, tmp_path: Path) -> None:
    def run(text: str) -> Scene:
        scene = Scene(say=lambda text: None, warn=lambda text: None)
        scene.add("left", fine)
        Interpreter(scene).run_text(text)
        return scene

    lines = PLATE + "STRENGTH LEFT INDEX 1\nSQUEEZE 5 8 LEFT 2.5\nPRESS 2 8 EVERY 2 CORRECT STATE 's.npz'"
    for name in ("whole", "cut"):
        (tmp_path / name).mkdir()
    whole = solved(run(lines), tmp_path / "whole")
    assert whole.solved.corrected

    def cut(what: str, done: int, total: int) -> None:
        if done == 1:
            raise KeyboardInterrupt

    scene = run(lines)
    before = run_contact(scene, tmp_path / "cut", progress=cut)
    assert before.solved.interrupted
    assert (tmp_path / "cut" / "s.npz").exists()
    after = run_contact(run(lines), tmp_path / "cut")
    assert after.solved.resumed == 1
    assert after.solved.corrected == whole.solved.corrected
    assert after.solved.edits == whole.solved.edits
    assert after.verdict.content() == whole.verdict.content()
    for one, other in zip(after.solved.frames, whole.solved.frames, strict=True):
        np.testing.assert_array_equal(one.displacement, other.displacement)


@pytest.mark.slow
def test_a_load_that_opening_cannot_lessen_is_named(run: Callable[[str], Scene], tmp_path: Path) -> None:
    """The hand as a whole is moved down on the plate: no joint has closed."""
    scene = run(
        "OBJECT plate BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165\nFLESH LEFT INDEX ELEMENT 0.003\n"
        "MOVE LEFT 0 0 0.002 0\nMOVE LEFT 10 0 -0.008 0\nSTRENGTH LEFT INDEX 0.1\nFRAMES 0 8\nPRESS 0 8 EVERY 2 CORRECT"
    )
    report = solved(scene, tmp_path)
    assert max(row.share for row in report.rows if row.digit == "index") > 1.0
    assert report.verdict.corrections
    for line in report.verdict.corrections:
        assert "index" in line
        assert "%) was not corrected" in line
    last = report.verdict.corrections[-1]
    assert "LEFT at frame 8" in last
    assert "its joints have not closed" in last
    assert "MOVE" in last


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "status", "text"),
    [
        ("LIFT 15 19 LEFT BALL WEIGHT 1.5 MOST 0.2", "LIMIT", "1.5 N of BALL: does not hold at the firmest grip"),
        ("STRENGTH LEFT THUMB 0.2\nLIFT 15 19 LEFT BALL WEIGHT 1", "TOO_WEAK", "than the muscles have"),
    ],
)
def test_what_is_too_heavy_is_said(
    run: Callable[[str], Scene], tmp_path: Path, lines: str, status: str, text: str
) -> None:
    report = solved(run(f"{BALL}{lines}\nPRESS 8 19"), tmp_path)
    (found,) = report.grips
    assert found.status == status, found.text
    assert text in found.text
    assert found.grip == 0.0
    assert found.lowered is None
    assert any(text in line for line in report.verdict.content()["grips"])
    # the thumb pushes it aside, but its foot keeps it from falling
    ball = report.surfaces.object("BALL", 19.0)
    assert abs(ball[:, 1].min() - (-0.0568 - 0.012)) < 2e-4


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("LIFT 15 19 LEFT BALL\nPRESS 0 16", r"frames must lie in those of PRESS, after 0 and up to 16"),
        ("LIFT 15 19 LEFT BALL\nPRESS 0 19 METHOD PAPER", r"knows no friction"),
        (
            "POINTS BALL top UPPER Y 0.1\nVECTOR BALL top AT 0 0 0 0\nLIFT 15 19 LEFT BALL\nPRESS 0 19",
            r"nothing but HOLD",
        ),
        (
            "GRAVITY 1 -9.81 0\nLIFT 15 19 LEFT BALL\nPRESS 0 19",
            r"a GRAVITY along one axis of the stage, got 1 -9.81 0",
        ),
        (
            "OBJECT RING BALL 0.02 AT 0.0411 -0.0348 -0.088\nPHYSICAL RING\nBOND BALL RING 1000 1000\n"
            "LIFT 15 19 LEFT BALL\nPRESS 0 19",
            r"takes the weight of one object, and BALL is bonded to RING",
        ),
        ("PHYSICAL BALL DENSITY 0\nLIFT 15 19 LEFT BALL\nPRESS 0 19", r"BALL weighs nothing"),
        ("LIFT 15 19 LEFT BALL\nPRESS 15 19", r"after 15 and up to 19, got 15 to 19"),
    ],
)
def test_grips_that_cannot_be_are_refused(
    run: Callable[[str], Scene], tmp_path: Path, lines: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        run_contact(run(BALL + lines), tmp_path)


def test_forces_that_cannot_be_shared_are_refused(run: Callable[[str], Scene]) -> None:
    run(BALL)
    for line, message in (
        ("SQUEEZE 15 19 LEFT FORCE 4 SHARED", r"<script>:1:34: expected BY here"),
        ("SQUEEZE 15 19 LEFT FORCE 4 SHARED BY FORCE", r"expected MUSCLES, found FORCE"),
        ("SQUEEZE 15 19 LEFT FORCE 4 SHARD BY MUSCLES", r"found SHARD; did you mean SHARED\?"),
        ("SQUEEZE 15 19 LEFT 4 SHARED BY MUSCLES", r"expected the end of the line, found SHARED"),
        ("SQUEEZE 15 19 LEFT FORCE 4 PINKY SHARED BY MUSCLES", r"pinky does not close here; thumb do"),
    ):
        with pytest.raises(InputError, match=message):
            run(line)


@pytest.mark.slow
def test_a_state_keeps_the_grip_that_was_found(
    pressed: tuple[Path, dict, Scene], rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def again(name: str) -> None:
        scene = Scene(say=lambda text: None)
        scene.add("left", rig)
        Interpreter(scene).run_text(FORCE + "PRESS 2 8 STATE 's.npz'\nEXPORT 'e.npz'")
        run_scene(scene, tmp_path / name)

    def stopped(*_: object) -> None:
        raise RuntimeError("cut off")

    with monkeypatch.context() as patch:  # while the grip is looked for: its frame, the first, does not count as done
        patch.setattr("warpjld.simulation.frames_run.find_grip", stopped)
        with pytest.raises(RuntimeError, match="cut off"):
            again("first")
    assert not (tmp_path / "first" / "s.npz").exists()
    again("first")
    out, _, _ = pressed
    for table in ("contact.csv", "grips.csv"):
        assert (tmp_path / "first" / table).read_bytes() == (out / table).read_bytes()
    shapes = (tmp_path / "first" / "e.npz").read_bytes()
    monkeypatch.setattr("warpjld.simulation.frames_run.find_grip", stopped)
    again("first")  # all of it out of the state
    assert (tmp_path / "first" / "e.npz").read_bytes() == shapes
    assert (tmp_path / "first" / "grips.csv").read_bytes() == (out / "grips.csv").read_bytes()
    ours, theirs = (_forces(folder / "contact.csv") for folder in (tmp_path / "first", out))
    np.testing.assert_allclose(ours, theirs, rtol=1e-4)  # bones' loads are found anew: the sixth digit may be another


def _forces(path: Path) -> list[float]:
    with path.open(encoding="utf-8") as file:
        return [float(row["force_n"]) for row in csv.DictReader(file)]
