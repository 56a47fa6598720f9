"""A scene made: files, summary, and nothing left behind where it fails."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from warpjld.errors import InputError, MissingExtraError
from warpjld.script import Interpreter, Scene, formats, making
from warpjld.script.folder import OutputFolder
from warpjld.script.runner import run_scene

BENT = "FINGER1 LEFT INDEX FLEXION AT 0 0\nFINGER1 LEFT INDEX FLEXION AT 3 60\nSIZE 160 120\n"


def everything(folder: Path) -> set[str]:
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*")}


def test_the_default_set(run, tmp_path) -> None:
    summary = run_scene(run(BENT), tmp_path / "out", script=Path("bend.jld"))
    assert everything(tmp_path / "out") == {"surface.npz", "film.mp4", "contact.png", "summary.json"}
    assert json.loads((tmp_path / "out" / "summary.json").read_text()) == summary
    assert summary["script"] == "bend.jld"
    assert summary["frames"] == {"first": 0, "last": 3, "count": 4}
    assert summary["rate"] == 30
    (actor,) = summary["actors"]
    assert (actor["name"], actor["keys"], actor["joints"]) == ("LEFT", 2, 26)
    made = {file["name"]: file["bytes"] for file in summary["files"]}
    assert set(made) == {"surface.npz", "film.mp4", "contact.png"}
    assert all((tmp_path / "out" / name).stat().st_size == size > 0 for name, size in made.items())
    assert set(summary["seconds"]) == {"bind", "frames", "pictures"}


def test_the_exported_surface_is_the_deformed_one(run, tmp_path) -> None:
    scene = run(BENT + "FRAMES 0 20\nEXPORT 'a.npz'")
    run_scene(scene, tmp_path)
    actor = scene.actor()
    with np.load(tmp_path / "a.npz") as file:
        vertices, frames = file["vertices"], file["frames"]
    np.testing.assert_array_equal(frames, np.arange(21))
    poses = actor.motion.poses(actor.skeleton, np.arange(21.0))
    expected = actor.rig.surface.to_source(actor.covering.deform(poses))
    np.testing.assert_array_equal(vertices, expected)
    rest = actor.rig.surface.to_source(actor.rig.surface.vertices)
    np.testing.assert_allclose(vertices[0], rest, atol=1e-6)
    assert np.abs(vertices[3] - rest).max() > 0.03


def test_pictures_show_something_and_have_the_size_asked_for(run, tmp_path) -> None:
    scene = run(BENT + "PICTURE 1.5 'deep/er/a.png'\nPICTURE 1.5 'b.png' WIREFRAME\nSIZE 200 100")
    run_scene(scene, tmp_path)
    for name in ("deep/er/a.png", "b.png"):
        with Image.open(tmp_path / name) as picture:
            assert picture.size == (200, 100)
            assert np.asarray(picture.convert("L")).std() > 5


def test_a_following_camera_sees_a_moving_actor_stand_still(run, tmp_path) -> None:
    scene = run("SIZE 80 60\nMOVE left 0 0 0 0\nMOVE left 10 0.5 0.2 0\nCAMERA PALMAR FOLLOW\nPICTURE 0 'a.png'")
    run("PICTURE 10 'b.png'\nCONTACT 'c.png' 0 10\nFILM 'd.gif'\nCAMERA PALMAR\nPICTURE 0 'e.png'\nPICTURE 10 'f.png'")
    run_scene(scene, tmp_path)
    a, b, e, f = (np.asarray(Image.open(tmp_path / f"{name}.png")).astype(int) for name in "abef")
    assert np.abs(a - b).mean() < 0.2
    assert np.abs(e - f).mean() > 1


def test_several_actors_have_a_file_each(run, hands, tmp_path) -> None:
    scene = run("FRAMES 0 1\nEXPORT 'two.npz'\nEXPORT 'one.npz' left")
    scene.add("right", hands["right"])
    run_scene(scene, tmp_path)
    assert everything(tmp_path) == {"two-left.npz", "two-right.npz", "one.npz", "summary.json"}
    left, right = (np.load(tmp_path / f"two-{side}.npz")["vertices"] for side in ("left", "right"))
    np.testing.assert_allclose(left * [-1, 1, 1], right, atol=1e-6)


def test_parameters_changed_between_runs_are_used_without_a_new_binding(run, tmp_path) -> None:
    scene = run(BENT + "EXPORT 'a.npz'")
    run_scene(scene, tmp_path / "1")
    domains = scene.actor().covering.domains
    run("PARAMETER ALL MUSCLE 0.9")
    run_scene(scene, tmp_path / "2")
    assert scene.actor().covering.domains is domains
    first, second = (np.load(tmp_path / k / "a.npz")["vertices"] for k in "12")
    assert np.abs(first - second)[3].max() > 1e-4


def test_the_method_is_the_one_chosen(run, tmp_path) -> None:
    run_scene(run(BENT + "EXPORT 'a.npz'"), tmp_path / "1")
    run_scene(run("METHOD PAPER"), tmp_path / "2")
    assert json.loads((tmp_path / "2" / "summary.json").read_text())["actors"][0]["method"] == "paper"
    first, second = (np.load(tmp_path / k / "a.npz")["vertices"] for k in "12")
    np.testing.assert_allclose(first[0], second[0], atol=1e-5)
    assert np.abs(first - second)[3].max() > 1e-4


def test_a_dry_run_names_what_would_be_made_and_makes_nothing(run, tmp_path) -> None:
    summary = run_scene(run(BENT + "FILM 'a.gif'\nEXPORT 'a.obj'"), tmp_path / "out", dry=True)
    assert [file["name"] for file in summary["files"]] == ["a.gif", "a.obj"]
    assert not (tmp_path / "out").exists()


def test_in_betweens_held_at_a_limit_are_noted(run, tmp_path) -> None:
    scene = run("LIMIT wrist FLEXION -70 40\nWRIST LEFT FLEXION AT 0 0\nWRIST LEFT FLEXION AT 4 40\n")
    run("SPLINE 0 0 -1\nWRIST LEFT FLEXION AT 9 40\nWRIST LEFT FLEXION AT 10 -60")
    notes = run_scene(scene, tmp_path / "out", dry=True)["notes"]
    assert any("left.wrist.flexion" in note and "held at the limit of 40°" in note for note in notes)


def test_nobody_on_stage(tmp_path) -> None:
    with pytest.raises(InputError, match="there is no actor yet"):
        run_scene(Scene(), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("failure", [RuntimeError("no more"), KeyboardInterrupt()])
def test_a_run_that_fails_leaves_the_folder_as_it_was(run, tmp_path, monkeypatch, failure) -> None:
    def fail(*_: object, **__: object) -> None:
        raise failure

    monkeypatch.setattr(making, "draw_contact_sheet", fail)
    new, old = tmp_path / "deep" / "new", tmp_path / "old"
    old.mkdir()
    (old / "surface.npz").write_text("from before")
    for folder in (new, old):
        with pytest.raises(type(failure)):
            run_scene(run(BENT), folder)
    assert everything(tmp_path) == {"old", "old/surface.npz"}
    assert (old / "surface.npz").read_text() == "from before"


def test_a_folder_that_cannot_be_written_is_named(run, tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file: is a file; want a folder"):
        run_scene(run(BENT), tmp_path / "file")
    with pytest.raises(InputError, match=r"file: is a file; want a folder"):
        run_scene(run(BENT), tmp_path / "file" / "out")
    (tmp_path / "out" / "surface.npz").mkdir(parents=True)
    with pytest.raises(InputError, match=r"surface\.npz: a folder stands where this file should go"):
        run_scene(run(BENT), tmp_path / "out")


def test_missing_extras_are_known_before_any_work(run, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(formats, "find_spec", lambda name: None)
    for line, extra in (("FILM 'a.mp4'", "film"), ("EXPORT 'a.usdc'", "usd")):
        scene = run(line)
        with pytest.raises(MissingExtraError, match=rf"warpjld\[{extra}\]"):
            run_scene(scene, tmp_path / "out")
        scene.outputs.clear()
    assert not (tmp_path / "out").exists()
    summary = run_scene(run(BENT), tmp_path / "out", dry=True)
    assert "film.gif" in [file["name"] for file in summary["files"]]
    assert "warpjld[film]" in summary["notes"][-1]


def test_files_move_into_place_only_at_the_end(tmp_path) -> None:
    with OutputFolder(tmp_path / "out") as out:
        out.place("a/b.txt").write_text("x")
        assert not (tmp_path / "out" / "a").exists()
    assert everything(tmp_path / "out") == {"a", "a/b.txt"}


def test_progress_is_told(run, tmp_path) -> None:
    seen = []
    run_scene(run(BENT + "EXPORT 'a.npz'"), tmp_path, progress=lambda *step: seen.append(step))
    assert seen[0] == ("binding left", 0, 1)
    assert ("frames", 3, 4) in seen


def test_the_preview_of_a_frame(run, tmp_path) -> None:
    scene = run(BENT)
    scene.folder = tmp_path / "out"
    said = run("SHOW WIREFRAME 1.5\nSHOW SHADED 3").said
    assert said == [str(tmp_path / "out" / "wireframe-1.5.png"), str(tmp_path / "out" / "shaded-3.png")]
    assert all(Path(path).is_file() for path in said)


def test_an_interpreter_can_run_a_second_script_on_the_same_scene(scene) -> None:
    interpreter = Interpreter(scene)
    interpreter.run_text("MACRO BEND degrees\nWRIST LEFT FLEXION AT 0 $degrees\nEND")
    interpreter.run_text("BEND 10")
    assert scene.actor().key_frames == [0]


def test_frames_past_the_motions_end_are_named(run, scene, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    scene.warn = told.append
    (tmp_path / "m.csv").write_text("frame,left.index.base.flexion\n0,0\n2,60\n")
    run("RATE 24\nMOTION 'm.csv'\nFRAMES 0 2\nEXPORT 'a.npz'")
    assert run_scene(scene, tmp_path / "out")["warnings"] == [] == told
    run("FRAMES 0 5")
    wanted = "LEFT: its motion goes from frame 0 to 2: frames 3 to 5 hold its last pose"
    assert run_scene(scene, tmp_path / "out", dry=True)["warnings"] == [wanted]
    run_scene(scene, tmp_path / "out", dry=True)
    assert told == [wanted], "once"
