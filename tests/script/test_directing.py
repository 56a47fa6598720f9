"""Camera ways, shots, lamps, backdrop and colours: what they are at a frame, and what is drawn of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from warpjld.errors import InputError
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.directing import camera_at, shot_at
from warpjld.script.runner import run_scene
from warpjld.script.staging import frame_numbers

STAGE = "OBJECT CUBE BOX 0.1 0.1 0.1 COLOR 'white'\nFRAMES 0 8\nSIZE 80 60\n"
WAY = "CAMERA FROM 0 0 1 TO 0 0 0 AT 0\nCAMERA FROM 1 0 1 TO 0 0.1 0 ZOOM 2 ROLL 90 AT 8\n"


def stage(text: str, folder: Path | None = None) -> Scene:
    scene = Scene(say=lambda text: None, folder=folder or Path("out"))
    Interpreter(scene).run_text(text)
    return scene


def test_a_camera_goes_through_its_keys() -> None:
    camera = stage(STAGE + WAY).camera
    first, middle, last = (camera_at(camera, frame) for frame in (0.0, 4.0, 8.0))
    assert first.position == pytest.approx((0.0, 0.0, 1.0))
    assert last.position == pytest.approx((1.0, 0.0, 1.0))
    assert (*last.target, last.zoom) == pytest.approx((0.0, 0.1, 0.0, 2.0))
    assert np.degrees(last.roll) == pytest.approx(90.0)
    assert middle.position == pytest.approx((0.5, 0.0, 1.0))
    assert not middle.keys


def test_a_shot_takes_the_camera_before_it_and_the_next_way_is_its_own() -> None:
    scene = stage(STAGE + WAY + "SHOT ONE 0 4\nCAMERA FROM 0 1 1 TO 0 0 0 AT 5\nSHOT TWO 5 8\n")
    one, two = scene.shots.values()
    assert [key.frame for key in one.camera.keys] == [0.0, 8.0]
    assert [key.frame for key in two.camera.keys] == [5.0]
    assert shot_at((one, two), 4.0) is one
    assert shot_at((one, two), 6.0) is two
    assert shot_at((one, two), 9.0) is None


def test_lamps_follow_their_keys() -> None:
    scene = stage(
        "LIGHT A KEY FROM 0 1 0 INTENSITY 0 AT 0\nLIGHT A KEY FROM 2 1 0 INTENSITY 1 AT 10\n"
        "LIGHT B DIRECTIONAL FROM 0 0 1 TO 0 0 -1 COLOR 'red'\n"
    )
    lamp = scene.lamps["A"].at(5.0)
    assert lamp.position == pytest.approx((1.0, 1.0, 0.0))
    assert lamp.intensity == pytest.approx(0.5)
    assert not lamp.parallel
    assert scene.lamps["B"].at(3.0).parallel
    assert scene.lamps["B"].at(3.0).color == "#ff0000"


def picture(text: str, folder: Path) -> np.ndarray:
    run_scene(stage(STAGE + text + "PICTURE 0 'a.png'\n", folder), folder)
    return np.asarray(Image.open(folder / "a.png").convert("RGB"), dtype=float)


def test_what_is_drawn(tmp_path: Path) -> None:
    front = "CAMERA FROM 0 0 0.6 TO 0 0 0\nBACKDROP 'blue'\n"
    dark = picture(front + "LIGHT A DIRECTIONAL FROM 0 0 -1\n", tmp_path / "dark")
    lit = picture(front + "LIGHT A DIRECTIONAL FROM 0 0 1\n", tmp_path / "lit")
    red = picture(front + "COLOR CUBE 'red'\nLIGHT A DIRECTIONAL FROM 0 0 1\n", tmp_path / "red")
    assert lit[2, 2] == pytest.approx([0.0, 0.0, 255.0], abs=3.0)
    assert lit[30, 40].mean() > 1.5 * dark[30, 40].mean()
    assert red[30, 40, 0] > 3.0 * red[30, 40, 1]


def test_a_film_cuts_from_shot_to_shot(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    import imageio_ffmpeg

    text = (
        "CAMERA FROM 0 0 0.5 TO 0 0 0\nSHOT NEAR 0 2\nCAMERA FROM 0 0 5 TO 0 0 0\nSHOT FAR 5 8\n"
        "BACKDROP 'black'\nFILM 'cut.mp4' SHOTS NEAR FAR\n"
    )
    run_scene(stage(STAGE + text, tmp_path), tmp_path)
    reader = imageio_ffmpeg.read_frames(str(tmp_path / "cut.mp4"))
    width, height = next(reader)["size"]
    bright = [np.frombuffer(one, np.uint8).reshape(height, width, 3).mean() for one in reader]
    assert len(bright) == 3 + 4
    assert min(bright[:3]) > 5.0 * max(bright[3:])


def test_frames_of_a_shot_that_are_not_made_are_told(tmp_path: Path) -> None:
    """They were missing from the film without a word."""
    scene = stage(STAGE + "SHOT LONG 0 50\nSHOT SHORT 51 60\nFILM 'cut.html' SHOTS LONG\n", tmp_path)
    last = float(frame_numbers(scene)[-1])
    notes = run_scene(scene, tmp_path, dry=True)["notes"]
    assert f"SHOT LONG has frames 0 to 50, of which only those from 0 to {last:g} are made: see FRAMES" in notes
    assert not [note for note in notes if "SHORT" in note]  # of no film


def test_an_actor_has_its_colour(hands: dict[str, Rig]) -> None:
    from warpjld.script.runner import cast

    scene = stage("")
    scene.add("left", hands["left"])
    scene.add("right", hands["right"])
    frames = np.zeros(1)
    assert cast(scene, frames).colors is None
    Interpreter(scene).run_text("COLOR RIGHT 'lime'\n")
    colors = cast(scene, frames).colors
    assert colors is not None
    assert colors[-1].tolist() == [0, 255, 0]
    assert colors[0].tolist() == [0xF0, 0xBD, 0xA4]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("CAMERA FRONT AT 3", "ROLL and AT are for a camera FROM a place"),
        ("SHOT A 5 3", "must not come before the first"),
        ("SHOT A 0 3\nSHOT A 4 5", "a shot A already"),
        ("SHOT A 0 5\nSHOT B 3 8\nFILM 'a.mp4' SHOTS A B", "shot B begins at frame 3, before A has ended"),
        ("FILM 'a.mp4' SHOTS A", "SHOTS needs names of shots; there are none"),
        ("SHOT A 0 5\nFILM 'a.mp4' SHOTS A B", r"a shot \(A\) or the style \(SHADED/WIREFRAME/PRESSURE\), found B"),
        ("LIGHT A SPOT FROM 0 0 1", "the kind of lamp"),
        ("LIGHT A KEY FROM 0 0 0", "cannot shine at its own place"),
        ("BACKDROP 'octarine'", "no colour 'octarine'"),
        ("COLOR NOBODY 'red'", "there is no actor or object NOBODY"),
    ],
)
def test_wrong_lines_are_named(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        stage(STAGE + text + "\n")


def test_shots_that_are_not_made_are_named(tmp_path: Path) -> None:
    scene = stage(STAGE + "SHOT LATE 20 30\nFILM 'a.gif' SHOTS LATE\n", tmp_path)
    with pytest.raises(InputError, match="none of its shots has a frame that is made"):
        run_scene(scene, tmp_path)
