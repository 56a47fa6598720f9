"""Actors, covering, outputs and looking: what each command leaves in the scene, and what it refuses."""

import json

import numpy as np
import pytest

from warpjld.covering import default_parameters, save_parameters
from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.script.outputs import CameraSetting, ContactSheet, Export, FilmOutput, Picture
from warpjld.script.staging import frame_numbers, stage

pytestmark = pytest.mark.usefixtures("quick_hands")


def test_hands_are_built_and_named(run) -> None:
    scene = run("HAND RIGHT BUILTIN RESOLUTION 1500 LENGTH 0.2 NAME ruth\nACTOR left")
    assert list(scene.actors) == ["LEFT", "RUTH"]
    assert scene.current == "LEFT"
    assert "right.index.base" in scene.actors["RUTH"].skeleton.names
    with pytest.raises(InputError, match=r"1:1: there is an actor RUTH already; give this one another with NAME"):
        run("HAND RIGHT BUILTIN RESOLUTION 1500 NAME Ruth")


def test_skin_is_parted_where_touch_says_so(run) -> None:
    scene = run("HAND RIGHT BUILTIN RESOLUTION 1500")
    assert scene.actor().touch == "off"
    assert run("TOUCH LIMIT").actor().touch == "limit"
    with pytest.raises(InputError, match=r"ON.*OFF.*LIMIT"):
        run("TOUCH MAYBE")


def test_rigs_come_from_files(data) -> None:
    left = next((data / "hand_webxr_generic").glob("*left*.glb"))
    scene = Scene()
    Interpreter(scene).run_text(f"HAND LEFT '{left}'\nWRIST LEFT FLEXION AT 0 20\nDOMAINS SKIN")
    assert scene.actor().rig.path == left
    assert scene.actor().domains == "skin"


@pytest.mark.parametrize(
    ("line", "place", "says"),
    [
        ("HAND", "1:5", "expected the side (LEFT/RIGHT)"),
        ("HAND LEFT", "1:10", "expected BUILTIN or a rig file in quotes"),
        ("HAND LEFT 'none.glb'", "1:11", "there is no file 'none.glb'"),
        ("HAND LEFT BUILTIN LENGHT 0.2", "1:19", "did you mean LENGTH?"),
        ("HAND LEFT BUILTIN LENGTH -1", "1:1", "length: want metres, between 0.05 and 0.30, got -1"),
        ("BODY body.glb", "1:6", "expected a rig file in quotes, found body.glb"),
        ("ACTOR lft", "1:1", "there is no actor lft; did you mean LEFT?"),
        ("AXIS index.base 0 0 0", "1:21", "an axis cannot be 0 0 0"),
        (
            "AXIS index.knuckle2 0.08 -0.22 -0.97",
            "1:32",
            "left.index.knuckle2 cannot bend about its own segment",
        ),
        ("INITIAL index.knuckle2 FLEXION 101", "1:32", "initial flexion 101° is beyond its limits, 0° to 100°; LIMIT"),
        ("INITIAL index.knuckle2 FLEXON 10", "1:24", "did you mean FLEXION?"),
        ("INITIAL index.knuckle2 FLEXION", "1:31", "expected the angle at rest in degrees"),
        ("WRIST LEFT FLEXION AT 0 3\nINITIAL index.knuckle2 FLEXION 10", "2:1", "INITIAL comes before its keys"),
        ("LIMIT index.base FLEXION 50 40", "1:29", "must not be below the smallest (50)"),
        ("INITIAL index.base FLEXION 40\nLIMIT index.base FLEXION 0 30", "2:28", "initial flexion 40° is beyond"),
        ("PARAMETER index.base PROXIMITY 0.9 0.9", "1:22", "sum to 1.2; at most 1 (C21)"),
        ("PARAMETER index.base PROXIMITY 0.9", "1:35", "expected value 2 of 2 for PROXIMITY"),
        ("PARAMETER index.base PEAK 1", "1:22", "must lie between 0 and 1"),
        ("PARAMETER index.base INFLATON 1", "1:22", "did you mean INFLATION?"),
        ("DOMAINS SKIN", "1:9", "has no painted weights"),
        ("CAMERA PALMER", "1:8", "did you mean PALMAR?"),
        ("CAMERA FROM 1 1 1 TO 1 1 1", "1:26", "cannot look at its own place"),
        ("PICTURE 3 'a.jpg'", "1:11", "want a name that ends in .png"),
        ("PICTURE 3 'a.png' WIREFRANE", "1:19", "did you mean WIREFRAME?"),
        ("FILM 'a.mp5'", "1:6", "did you mean .mp4?"),
        ("EXPORT 'a'", "1:8", "want a name that ends in"),
        ("EXPORT '../a.usd'", "1:8", "want a name inside the output folder"),
        ("EXPORT '/a.usd'", "1:8", "want a name inside the output folder"),
        ("EXPORT 'a.npz' nobody", "1:1", "there is no actor nobody"),
        ("EXPORT_MOTION 'a.mdd'", "1:15", "want a name that ends in .bvh, .glb"),
        ("EXPORT_MOTION 'a.bvh' nobody", "1:1", "there is no actor nobody"),
        ("EXPORT 'a.glb'\nEXPORT_MOTION 'A.glb'", "2:15", "'A.glb' is asked for twice"),
        ("FILM 'a.mp4'\nFILM 'A.mp4'", "2:6", "'A.mp4' is asked for twice"),
        ("SHOW VALEUS 3", "1:6", "did you mean VALUES?"),
        ("HELP WRST", "1:6", "did you mean WRIST?"),
    ],
)
def test_refusals(run, line: str, place: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        run(line)
    assert str(caught.value).startswith(f"<script>:{place}: ")
    assert says in str(caught.value)


@pytest.mark.parametrize("lines", ["FRAMES 0 1e12", "WRIST LEFT FLEXION AT 0 0\nWRIST LEFT FLEXION AT 1e11 10"])
def test_more_frames_than_can_be_made(run, lines: str) -> None:
    with pytest.raises(InputError, match=r"FRAMES <first> <last> chooses which.*the limit is 2,000,000"):
        frame_numbers(run(lines))


def test_axis_and_parameters(run, tmp_path, monkeypatch) -> None:
    scene = run("AXIS index.base 0 2 0\nPARAMETER LEFT index.knuckle2 PROXIMITY 0.1 0.15\nPARAMETER ALL MUSCLE 0.5")
    actor = scene.actor()
    np.testing.assert_array_equal(actor.skeleton.axes[actor.skeleton.index("index.base")], [0, 1, 0])
    np.testing.assert_array_equal(actor.parameters.proximity[actor.skeleton.index("index.knuckle2")], [0.1, 0.15])
    assert (actor.parameters.muscle == 0.5).all()
    monkeypatch.chdir(tmp_path)
    defaults = default_parameters(actor.skeleton)
    save_parameters("p.json", actor.skeleton, defaults)
    np.testing.assert_allclose(run("PARAMETERS 'p.json'").actor().parameters.muscle, defaults.muscle, atol=1e-6)


def test_outputs_keep_the_camera_of_their_line(run) -> None:
    scene = run(
        "CAMERA PALMAR FOLLOW ZOOM 1.5\nPICTURE 3 'a/one.png' wireframe\nCAMERA FROM 0 0 1 TO 0 0 0\n"
        "FILM 'a.mp4'\nCONTACT 'sheet.png' 1 2.5\nEXPORT 'a.usda' left\nSIZE 320 200"
    )
    palmar, free = CameraSetting("palmar", zoom=1.5, follow=True), CameraSetting(None, (0, 0, 1), (0, 0, 0))
    assert scene.outputs == [
        Picture("a/one.png", 3, "wireframe", palmar),
        FilmOutput("a.mp4", "shaded", free),
        ContactSheet("sheet.png", (1, 2.5), free),
        Export("a.usda", "LEFT"),
    ]
    assert scene.size == (320, 200)


def test_values_can_be_read_at_keys_and_between(run) -> None:
    said = run("WRIST LEFT FLEXION AT 0 0\nWRIST LEFT FLEXION AT 10 40\nSHOW VALUES 10\nSHOW VALUES 5").said
    assert "left.wrist.flexion" in said[0]
    assert "40.000°  key" in said[0]
    assert "20.000°  in-between" in said[1]
    tip = next(line for line in said[0].splitlines() if "left.middle.tip" in line)
    assert len(tip.split()) == 4


def test_looking_around(run) -> None:
    said = run("SHOW ACTORS\nSHOW JOINTS\nSHOW PARAMETERS\nSHOW OUTPUTS\nHELP\nHELP finger1").said
    assert said[0].startswith("* LEFT")
    assert "  13  left.index.knuckle2" in said[1]
    assert "proximity" in said[2]
    assert said[3] == "nothing asked for yet"
    assert "METACARPUS" in said[4]
    assert said[5].startswith("FINGER1 <LEFT/RIGHT>")


def test_a_motion_file_drives_an_actor(run, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.csv").write_text("frame,left.index.base.flexion\n0,0\n2,60\n")
    scene = run("RATE 24\nMOTION 'm.csv'")
    assert scene.actor().recorded is not None
    np.testing.assert_array_equal(frame_numbers(scene), [0, 1, 2])
    flexion = stage(scene.actor(), np.array([0.0, 1.0, 2.0, 5.0]), 24).flexion[
        :, scene.actor().skeleton.index("index.base")
    ]
    np.testing.assert_allclose(np.degrees(flexion), [0, 30, 60, 60], atol=1e-9)
    with pytest.raises(InputError, match="driven by a MOTION file: no keys can be set"):
        run("WRIST LEFT FLEXION AT 0 3")


def test_parameter_files_say_where_they_are_wrong(run, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "p.json").write_text(json.dumps({"joints": {"index.base": {"inflatoin": 1}}}))
    with pytest.raises(InputError, match=r"p\.json: joint 'index.base': unknown parameter 'inflatoin'"):
        run("PARAMETERS 'p.json'")


def test_initial_angles_count_from_the_straight_joint(run, scene) -> None:
    """At its initial angle a joint is at rest, with none of its own it goes back by as much; unkeyed it stays."""
    run("INITIAL index.knuckle2 FLEXION 30")
    run("JOINT left.index.knuckle2 FLEXION AT 0 30\nJOINT left.index.knuckle2 FLEXION AT 9 0")
    tip = scene.actor().skeleton.index("index.tip")
    found = stage(scene.actor(), np.array([0.0, 9.0]), scene.rate).positions[:, tip]
    np.testing.assert_allclose(found[0], scene.actor().skeleton.rest[tip], atol=1e-12)
    plain = scene.add("plain", scene.actor().rig)
    run("LIMIT index.knuckle2 FLEXION -40 100\nJOINT left.index.knuckle2 FLEXION AT 9 -30")
    np.testing.assert_allclose(stage(plain, np.array([9.0]), scene.rate).positions[0, tip], found[1], atol=1e-12)
    still = scene.add("still", plain.rig)
    run("INITIAL index.knuckle2 FLEXION 30\nWRIST LEFT FLEXION AT 0 0")
    np.testing.assert_allclose(stage(still, np.zeros(1), scene.rate).positions[0], still.skeleton.rest, atol=1e-12)


def test_joints_are_shown_with_their_angles_at_rest(run, scene) -> None:
    run("INITIAL index.knuckle2 FLEXION 30\nSHOW JOINTS")
    line = next(line for line in scene.said[-1].splitlines() if "left.index.knuckle2" in line)
    assert line.endswith("flexion 0…100; at rest flexion 30")
