"""Every example, drawn small and of a few frames; the main one whole under the mark ``slow``."""

import csv
import runpy
from dataclasses import replace
from functools import partial
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest

from tests.simulation.gentler import gentler, watched
from warpjld import FleshMaterial
from warpjld.cli import main
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.hand.kept import kept_hand
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene, all_commands
from warpjld.script.outputs import Picture
from warpjld.script.plugin import load_commands
from warpjld.script.runner import run_scene
from warpjld.skeleton import DIGITS

pytestmark = pytest.mark.usefixtures("coarse_hands")

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
SCRIPTS = [
    pytest.param(path.name, marks=pytest.mark.slow if path.name == "reach.jld" else ())
    for path in sorted(EXAMPLES.glob("*.jld"))
    if not path.name.startswith(("press_", "hold_", "flesh_", "cut_", "falls", "loads"))
]
PRESSED = sorted(path.name for path in EXAMPLES.glob("press_*.jld"))


@pytest.fixture
def coarse_hands(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Built-in hands are built once a session; coarse, where a test is not of their sizes and forces."""
    if request.node.get_closest_marker("slow"):
        request.getfixturevalue("quick_hands")
        return

    def coarse(side: str = "left", resolution: int = 1500, **options: float) -> Rig:
        return kept_hand(side, resolution=min(resolution, 1500), **options)

    # the outer names first: they are looked up in the inner ones when they are first used
    for place in ("warpjld.build_hand", "warpjld.hand.build_hand", "warpjld.hand.kept.kept_hand"):
        monkeypatch.setattr(place, coarse)


def run_small(name: str, out: Path, frames: tuple[int, int] | None = None, text: str = "") -> dict:
    """Run a script of the examples in small pictures, and these frames only; with another text, if one is given."""
    scene = Scene(folder=out, say=lambda text: None)
    if text:
        Interpreter(scene).run_text(text)
    else:
        Interpreter(scene).run_file(EXAMPLES / name)
    scene.size = (120, 90)
    if frames is not None:
        scene.first, scene.last = frames
    return run_scene(scene, out)


@pytest.fixture
def grip():
    """The example of a user's command, forgotten afterwards."""
    load_commands(EXAMPLES / "user_command.py")
    yield
    all_commands().remove("GRIP")


@pytest.mark.parametrize("name", SCRIPTS)
def test_scripts(name: str, tmp_path, grip) -> None:
    summary = run_small(name, tmp_path, frames=(20, 22))
    expected = (
        "that has no flesh is pushed aside",  # beside the thumb's ball
        "of which only those from 20 to 22 are made",  # shots of more frames than are made here
    )
    assert all(any(text in note for text in expected) for note in summary["notes"])
    assert {Path(file["name"]).suffix for file in summary["files"]} >= {".mp4", ".png"}


def test_a_hand_digitised_half_closed(tmp_path) -> None:
    away = runpy.run_path(str(EXAMPLES / "half_closed.py"))["main"](tmp_path, (120, 90))
    assert away < 0.4
    assert (tmp_path / "flat.png").stat().st_size > 1000


def test_a_hand_of_several_meshes(tmp_path) -> None:
    parted = runpy.run_path(str(EXAMPLES / "pieces.py"))["main"](tmp_path, (120, 90))
    assert parted.keys() == {"SMOOTH", "PAPER"}
    assert max(parted.values()) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESSED)
def test_pressing(name: str, tmp_path) -> None:
    scene = Scene(folder=tmp_path, say=lambda text: None)
    Interpreter(scene).run_file(EXAMPLES / name)
    scene.size = (120, 90)
    last = {
        "press_ball.jld": 34,
        "press_ball_on_table.jld": 14,
        "press_fist.jld": 34,
        "press_pinch.jld": 32,
        "press_plate.jld": 18,
        "press_weak.jld": 8,
    }[name]
    scene.first, scene.last = last - 2, last
    scene.contact.pressing = replace(scene.contact.pressing, last=last)
    scene.outputs = [replace(o, frame=min(o.frame, last)) if isinstance(o, Picture) else o for o in scene.outputs]
    Interpreter(scene).run_text("EXPORT 'seen.npz'")
    summary = run_scene(scene, tmp_path)
    assert overlap(tmp_path) < 2e-4
    assert summary["press"]["status"] == "CONVERGED"
    assert summary["press"]["verdict"].startswith("realistic")
    assert summary["press"]["digits"]
    expected = ["that has no flesh is pushed aside"]  # beside the thumb's ball
    if name == "press_fist.jld":
        expected.append("elements of 4 mm are too large")  # a first look, in minutes
    assert all(any(one in note for one in expected) for note in summary["notes"])
    rows = list(csv.DictReader((tmp_path / "contact.csv").open(encoding="utf-8")))
    total = [
        sum(float(r["force_n"]) for r in rows if r["frame"] == frame)
        for frame in dict.fromkeys(r["frame"] for r in rows)
    ]
    assert total[-1] > total[0]
    assert 0.05 < total[-1] < 100.0


def overlap(folder: Path) -> float:
    """How deep the visible surfaces are in one another at the last frame [m], not each in itself."""
    surfaces = []
    for path in sorted(folder.glob("seen*.npz")):
        with np.load(path) as file:
            surfaces.append(Facets(file["vertices"][-1].astype(float), file["faces"]))
    assert surfaces
    depths = [-one.project(other.vertices).distance.min() for one, other in permutations(surfaces, 2)]
    return float(max(depths, default=0.0))


def test_loads_bend_bars(tmp_path) -> None:
    text = (EXAMPLES / "loads.jld").read_text(encoding="utf-8")
    assert "ELEMENT 0.006" in text
    summary = run_small("loads.jld", tmp_path, text=text.replace("ELEMENT 0.006", "ELEMENT 0.012"))
    assert summary["press"]["status"] == "CONVERGED"
    assert summary["notes"] == []
    assert (tmp_path / "loads.png").stat().st_size > 1000


def test_a_bar_in_pieces_parts(tmp_path) -> None:
    summary = run_small("cut_bar.jld", tmp_path)
    assert summary["press"]["status"] == "CONVERGED"
    assert sorted(summary["notes"]) == [f"BAR_{one} and BAR_2 part between frames 1 and 2 wholly" for one in (1, 3)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["flesh_pads.jld", "flesh_palms.jld", "flesh_handshake.jld", "flesh_forearm.jld"])
def test_flesh_of_two_actors(name: str, tmp_path) -> None:
    """Both hands press, each on the other, with forces that sum to nothing (R126)."""
    summary = run_small(name, tmp_path)
    assert summary["press"]["status"] == "CONVERGED"
    rows = list(csv.DictReader((tmp_path / "contact.csv").open(encoding="utf-8")))
    last = [row for row in rows if row["frame"] == rows[-1]["frame"]]
    forces: dict[str, np.ndarray] = {}
    for row in last:
        force = np.array([float(row[f"f{axis}_n"]) for axis in "xyz"])
        forces[row["actor"]] = forces.get(row["actor"], np.zeros(3)) + force
    one, other = forces.values()
    assert np.linalg.norm(one) > 0.1
    assert np.linalg.norm(one + other) < 1e-5 * np.linalg.norm(one)  # the table has six digits


@pytest.mark.slow
def test_bones_of_a_file(tmp_path, capsys) -> None:
    """Waisted bones in place of round ones: another force of the same size."""
    forces = runpy.run_path(str(EXAMPLES / "bones.py"))["main"](tmp_path, 0.004)
    assert capsys.readouterr().out.count("CONVERGED") == 2
    assert forces["round"] > 0.5
    assert 0.3 < forces["waisted"] / forces["round"] < 3.0
    assert forces["waisted"] != pytest.approx(forces["round"], rel=0.01)


@pytest.mark.slow
def test_an_arm_of_flesh_bends(tmp_path) -> None:
    summary = run_small("flesh_elbow.jld", tmp_path)
    assert summary["press"]["status"] == "CONVERGED"


@pytest.mark.slow
def test_objects_alone_fall(tmp_path) -> None:
    scene = Scene(folder=tmp_path, say=lambda text: None)
    Interpreter(scene).run_file(EXAMPLES / "falls.jld")
    scene.size = (120, 90)
    Interpreter(scene).run_text("EXPORT 'seen.npz'")
    summary = run_scene(scene, tmp_path)
    assert summary["press"]["status"] == "CONVERGED"
    assert (
        "BLOCK is held by nothing: it falls from frame 0 on, and comes to rest on FLOOR" in summary["press"]["verdict"]
    )
    assert "comes to rest on BOWL" in summary["press"]["verdict"]
    with np.load(tmp_path / "seen-ball.npz") as file:
        middle = file["vertices"][-1].mean(axis=0)
    assert np.linalg.norm(middle - [-0.16, 0.016, 0.02]) < 1e-3
    with np.load(tmp_path / "seen-block.npz") as file:
        assert file["vertices"][-1][:, 1].min() == pytest.approx(0.0, abs=1e-4)


@pytest.mark.slow
def test_a_bar_falls_apart(tmp_path) -> None:
    verdict = run_small("falls_apart.jld", tmp_path)["press"]["verdict"]
    assert "the bond of BAR_1 and BAR_2 opens at frame 6." in verdict
    assert "on impact on EDGE at 2 m/s" in verdict
    assert verdict.count("comes to rest on FLOOR") == 2


@pytest.mark.slow
def test_holding_a_ball_as_gently_as_can_be(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    lifts = watched(monkeypatch)
    summary = run_small("hold_ball.jld", tmp_path, frames=(41, 44))
    assert summary["press"]["status"] == "CONVERGED"
    (found,) = summary["press"]["searches"]
    assert found["status"] == "HELD"
    weight, friction = 0.5, 0.6
    rows = list(csv.DictReader((tmp_path / "contact.csv").open(encoding="utf-8")))
    for frame in ("41", "42", "43", "44"):
        force = np.array([[float(r[f"f{k}_n"]) for k in "xyz"] for r in rows if r["frame"] == frame])
        np.testing.assert_allclose(force.sum(axis=0), [0.0, -weight, 0.0], atol=1e-3 * weight)
    pads = list(csv.DictReader((tmp_path / "touch.csv").open(encoding="utf-8")))
    for row in pads:
        force = [float(row[f"force_{k}"]) for k in "xyz"]
        assert np.linalg.norm(force) <= (1.0 + 1e-6) * np.hypot(1.0, friction) * float(row["normal_force"]) + 1e-9
    # friction bears at most its coefficient times the force that presses
    assert found["force_n"] > weight / friction
    slid = [trial for trial in found["trials"] if not trial["held"]]
    assert slid
    assert all(trial["grip_deg"] < found["grip_degrees"] for trial in slid)
    (trials,) = lifts
    less, share = gentler(trials, np.radians(found["grip_degrees"]), 0.9)
    assert share == pytest.approx(0.9, abs=0.01)
    assert not less.held  # nine tenths of the force do not hold it
    assert (tmp_path / "touch.png").is_file()


def test_the_fist_closes_thumb_last_and_opens_again() -> None:
    scene = Scene()
    Interpreter(scene).run_file(EXAMPLES / "fist.jld")
    actor = scene.actor()
    frames = np.arange(scene.first, scene.last + 1.0)
    assert len(frames) == 60
    assert scene.rate == 30
    poses = actor.motion.poses(actor.skeleton, frames)
    tip = {f: poses.positions[:, actor.skeleton.index(f"{f}.tip")] for f in DIGITS}
    base = {f: poses.positions[:, actor.skeleton.index(f"{f}.base")] for f in DIGITS}
    reach = {f: np.linalg.norm(tip[f] - base[f], axis=1) for f in DIGITS if f != "thumb"}
    for finger, distance in reach.items():
        assert distance[30] < 0.6 * distance[0], f"{finger} is folded in the fist"
        assert distance[59] == pytest.approx(distance[0], abs=0.004), f"{finger} ends as it began"
    moved = {f: int(np.argmax(np.linalg.norm(t - t[0], axis=1) > 0.02)) for f, t in tip.items()}
    assert max(moved, key=moved.get) == "thumb"
    middle = poses.positions[30, actor.skeleton.index("middle.knuckle3")]
    assert tip["thumb"][30, 1] < middle[1], "the thumb lies on the palm's side of the folded fingers"
    assert np.linalg.norm(tip["thumb"][30] - middle) < 0.035


def test_python_api(tmp_path, capsys) -> None:
    names = runpy.run_path(str(EXAMPLES / "python_api.py"))
    path = names["main"](tmp_path)
    with np.load(path) as file:
        assert file["vertices"].shape[0] == 31
        assert np.isfinite(file["vertices"]).all()
    assert "31 frames" in capsys.readouterr().out


def test_python_contact(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.FleshMaterial", partial(FleshMaterial, element=0.004))
    names = runpy.run_path(str(EXAMPLES / "python_contact.py"))
    found = names["found"]
    assert found.solved.status.name == "CONVERGED"
    assert found.force("hand")[-1, 1] > 0.1, "the plate pushes the finger up"
    assert "upwards on the finger" in capsys.readouterr().out


@pytest.mark.slow
def test_python_grasp(capsys) -> None:
    names = runpy.run_path(str(EXAMPLES / "python_grasp.py"))
    assert names["found"].solved.status.name == "CONVERGED"
    assert " N on " in capsys.readouterr().out


def test_grasp_objects(tmp_path, capsys) -> None:
    """One ball; the example's other objects and the real ones take the same way."""
    study = tmp_path / "one.toml"
    text = (EXAMPLES / "grasp_objects.toml").read_text(encoding="utf-8")
    one = text[: text.index('[[objects]]\nbuiltin = "box"')].replace("trials = 4", "trials = 1")
    study.write_text(one + "[wrist]\nbest_of = 16\n", encoding="utf-8")
    (row,) = runpy.run_path(str(EXAMPLES / "grasp_objects.py"))["main"](tmp_path / "out", study)
    assert row["success"]
    assert row["penetration"] <= 1e-3
    assert "1 of 1 grasps hold" in capsys.readouterr().out
    assert (tmp_path / "out" / "built-in.png").stat().st_size > 0
    assert "| built-in | ball | yes |" in (tmp_path / "out" / "grasps.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_block_is_held_gently(tmp_path, capsys) -> None:
    found = runpy.run_path(str(EXAMPLES / "hold_block.py"))["main"](tmp_path, 0.6, 0.5)
    assert 0.5 * found.trial.force == pytest.approx(0.6, rel=0.02)
    assert "0.600 N are needed" in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {"pads.png", "pads.csv", "pads.columns.json", "block.png"}


@pytest.mark.slow
def test_the_main_example_whole(tmp_path) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["run", str(EXAMPLES / "fist.jld"), "-o", str(tmp_path / "out")])
    assert ended.value.code == 0
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert made == {"surface.npz", "film.mp4", "contact.png", "summary.json"}


def test_methods_are_compared(data: Path, tmp_path: Path) -> None:
    from warpjld.covering import default_parameters, save_parameters
    from warpjld.io import load_rig

    rig = data / "hand_webxr_generic" / "left.glb"
    skeleton = load_rig(rig).skeleton
    save_parameters(tmp_path / "p.json", skeleton, default_parameters(skeleton))
    compare = runpy.run_path(str(EXAMPLES / "compare_methods.py"))["main"]
    text = compare([str(rig), "-o", str(tmp_path), "--parameters", str(tmp_path / "p.json"), "--tables-only"])
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()[2:]]
    assert len(rows) == 6 * 4
    assert {row[1] for row in rows} == {"LBS", "DQS", "JLD default", "JLD calibrated"}
    folded = {(row[0], row[1]): int(row[4]) for row in rows}
    for pose in {row[0] for row in rows}:
        assert folded[pose, "JLD default"] <= min(folded[pose, "LBS"], folded[pose, "DQS"])
    assert (tmp_path / "table.md").read_text(encoding="utf-8").strip() == text


@pytest.mark.slow
def test_forces_depend_little_on_the_size_of_elements() -> None:
    rows = np.array(runpy.run_path(str(EXAMPLES / "flesh_sizes.py"))["main"]([1.8, 2.2, 2.6, 3.0]))
    assert (np.diff(rows[:, 1]) < 0.0).all()
    forces = rows[:, 5]
    assert np.abs(forces / forces[0] - 1.0).max() < 0.15


def test_points_are_placed(tmp_path) -> None:
    assert runpy.run_path(str(EXAMPLES / "place_points.py"))["main"](tmp_path) < 8.0


@pytest.mark.slow
def test_a_misplaced_joint_is_found_and_moved_back(tmp_path) -> None:
    messages, away = runpy.run_path(str(EXAMPLES / "misplaced.py"))["main"](tmp_path, (120, 90))
    assert [m.partition(" ")[0] for m in messages] == ["left.index.knuckle2"]
    assert away < 3.0
    assert (tmp_path / "moved.png").stat().st_size > 1000
