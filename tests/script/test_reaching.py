"""REACH in scripts: the skin of the hand is where it was asked, and what does not go is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.geometry.winding import winding_numbers
from warpjld.grasp.arm_clearance import pierced_faces
from warpjld.grasp.palm import palm_of
from warpjld.io import load_rig
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.arm_way import pierced_frames
from warpjld.script.binding import cover
from warpjld.script.grasping import Attempt
from warpjld.script.staging import stage
from warpjld.skeleton import DIGITS
from warpjld.skeleton.arm import arm_of


@pytest.fixture(scope="module")
def anny(data: Path) -> Scene:
    """A coarse body on stage, bound once."""
    scene = Scene(say=lambda text: None, warn=lambda text: None)
    scene.add("anny", load_rig(data / "body_anny" / "body_lowpoly_163joints.glb"))
    cover(scene.actor())
    return scene


def _fresh(scene: Scene) -> Scene:
    old = scene.actor()
    new = Scene(say=lambda text: None, warn=lambda text: None)
    actor = new.add("anny", old.rig)
    actor.covering, actor.covered, actor.parameters = old.covering, old.covered, old.parameters
    return new


@pytest.mark.parametrize(
    ("side", "place", "part"),
    [("LEFT", (0.25, 0.35, 0.35), "PALM"), ("RIGHT", (-0.3, 0.2, 0.3), "INDEX"), ("LEFT", (0.35, 0.4, 0.2), "WRIST")],
)
def test_the_hand_is_where_it_was_asked(anny: Scene, side: str, place: tuple[float, ...], part: str) -> None:
    scene = _fresh(anny)
    actor = scene.actor()
    Interpreter(scene).run_text(f"REACH 0 20 {side} AT {place[0]} {place[1]} {place[2]} WITH {part}")
    (attempt,) = scene.attempts
    assert attempt.status == "CONVERGED"
    rest, poses = (stage(actor, np.array([frame]), scene.rate) for frame in (0.0, 20.0))
    covering = cover(actor)
    if part == "WRIST":
        at = poses.positions[0, actor.skeleton.index(f"{side.lower()}.wrist")]
        assert np.linalg.norm(at - place) < 2e-3
    else:
        skin = covering.deform(poses)[0]
        assert np.linalg.norm(skin - np.array(place), axis=1).min() < 2e-3
    # feet and trunk stay
    for joint in ("pelvis", "left.ankle", "right.ankle", "head"):
        k = actor.skeleton.index(joint)
        np.testing.assert_allclose(poses.positions[0, k], rest.positions[0, k], atol=1e-12)


def test_the_palm_lies_on_an_object(anny: Scene) -> None:
    scene = _fresh(anny)
    Interpreter(scene).run_text("OBJECT APPLE BALL 0.08 AT 0.25 0.35 0.4\nREACH 0 20 LEFT APPLE")
    (attempt,) = scene.attempts
    assert attempt.status == "CONVERGED"
    actor = scene.actor()
    skin = cover(actor).deform(stage(actor, np.array([20.0]), scene.rate))[0]
    nearest = np.linalg.norm(skin - np.array([0.25, 0.35, 0.4]), axis=1).min()
    assert 0.03 < nearest < 0.043


def test_what_is_out_of_reach_is_said_with_the_distance(anny: Scene) -> None:
    scene = _fresh(anny)
    told: list[str] = []
    scene.warn = told.append
    Interpreter(scene).run_text("REACH 0 20 LEFT AT 0.3 0.3 2.5")
    (attempt,) = scene.attempts
    assert attempt.status == "SHORT"
    assert "out of reach" in told[0]
    assert attempt.values["short_mm"] > 1500.0


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("REACH 0 20 LEFT CUP", "there is no object CUP"),
        ("REACH 20 0 LEFT AT 0 0 0", "key2 must come after key1"),
        ("REACH 0 20 LEFT AT 0 0", "z|number"),
        ("REACH 0 20 LEFT AT 0 0 0 WITH TOE", "PALM"),
    ],
)
def test_wrong_lines(anny: Scene, line: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        Interpreter(_fresh(anny)).run_text(line)


def test_a_hand_alone_has_no_arm(run: Callable[[str], Scene]) -> None:
    with pytest.raises(InputError, match="a hand without an arm"):
        run("REACH 0 20 LEFT AT 0 0 0")


def test_a_thigh_behind_the_palm_is_no_palm(figure: Rig) -> None:
    """The built-in body: its palms look at its thighs."""
    palm = palm_of(figure.skeleton, "left")
    middle = palm.on_skin(figure.surface.vertices).middle
    assert np.linalg.norm(middle - palm.middle) < 0.03


@pytest.mark.slow
def test_a_place_inside_the_body_is_not_entered(anny: Scene) -> None:
    """In the thigh: the hand stays outside, and it is said how far away."""
    scene = _fresh(anny)
    scene.warn = lambda text: None
    hip, knee = (scene.actor().skeleton.rest[scene.actor().skeleton.index(f"left.{j}")] for j in ("hip", "knee"))
    x, y, z = 0.8 * hip + 0.2 * knee
    Interpreter(scene).run_text(f"REACH 0 20 LEFT AT {x} {y} {z}")
    (attempt,) = scene.attempts
    assert attempt.status == "SHORT"
    assert "20" not in attempt.values["pierced_faces"]


@pytest.mark.slow
@pytest.mark.parametrize("side", ["LEFT", "RIGHT"])
def test_targets_around_a_body(anny: Scene, side: str) -> None:
    """20 targets at five heights from shoulder to knee, four around the body: reached to 2 mm, or named with how far
    they are out of reach; in either case inside the limits, with still feet, and no part of the arm in the trunk."""
    skeleton = anny.actor().skeleton
    rest = dict(zip(skeleton.names, skeleton.rest, strict=True))
    sign = 1.0 if side == "LEFT" else -1.0
    half = np.linalg.norm(rest["left.shoulder"] - rest["right.shoulder"]) / 2.0
    middle = (rest["left.hip"] + rest["right.hip"]) / 2.0
    shoulder, hip, knee = (rest[f"left.{joint}"][1] for joint in ("shoulder", "hip", "knee"))
    heights = (shoulder, (shoulder + hip) / 2, hip, (hip + knee) / 2, knee)
    around = ((-0.8, 1.1), (0.5, 1.1), (1.6, 0.3), (0.7, -1.1))  # outwards and forward, in half widths of the shoulders
    reached = 0
    for height in heights:
        for out, ahead in around:
            scene = _fresh(anny)
            place = np.array([middle[0] + sign * half * out, height, middle[2] + half * ahead])
            Interpreter(scene).run_text(f"REACH 0 20 {side} AT {' '.join(f'{x:.6f}' for x in place)}")
            (attempt,) = scene.attempts
            check_reach(scene, side.lower(), place, attempt)
            reached += attempt.status == "CONVERGED"
    assert reached >= 12  # what hangs below the hips is out of reach of an upright body


def check_reach(scene: Scene, side: str, place: np.ndarray, attempt: Attempt) -> None:
    actor = scene.actor()
    covering, arm = cover(actor), arm_of(actor.skeleton, side)
    rest, poses = (stage(actor, np.array([frame]), scene.rate) for frame in (0.0, 20.0))
    skin = covering.deform(poses)[0].astype(np.float64)
    assert attempt.status in ("CONVERGED", "SHORT"), attempt.message
    if attempt.status == "CONVERGED":
        assert np.linalg.norm(skin - place, axis=1).min() < 2e-3
    else:
        assert "out of reach" in attempt.message
        assert attempt.values["short_mm"] > 2.0
    values = arm.values(actor.motion.sample(np.array([20.0]), actor.skeleton)[0][0])
    assert (values >= arm.limits[:, 0] - 1e-6).all()
    assert (values <= arm.limits[:, 1] + 1e-6).all()
    for joint in ("pelvis", "left.ankle", "right.ankle"):
        k = actor.skeleton.index(joint)
        np.testing.assert_allclose(poses.positions[0, k], rest.positions[0, k], atol=1e-12)
    # by the winding number, not by the spheres that the search goes by
    faces = actor.rig.surface.faces
    anchors, names = covering.anchors, actor.skeleton.names
    strongest = anchors.segment[np.arange(len(anchors)), anchors.weight.argmax(axis=1)]
    ends = np.array([names[j] for j in anchors.ends[strongest, 0]])
    hand = tuple(f"{side}.{part}" for part in ("elbow", "wrist", *DIGITS))
    below = np.array([name.startswith(hand) for name in ends])
    whole = below | np.array([name == f"{side}.shoulder" for name in ends])
    trunk = faces[~whole[faces].any(axis=1)]
    assert not (winding_numbers(skin, trunk, skin[below]) > 0.5).any()


@pytest.mark.slow
def test_the_way_behind_the_shoulder_leads_around_the_body(anny: Scene) -> None:
    """Straight from hanging to behind the shoulder, forearm and hand would pass through the trunk."""
    scene = _fresh(anny)
    actor = scene.actor()
    x, y, z = actor.skeleton.rest[actor.skeleton.index("left.shoulder")] + [0.0, -0.05, -0.3]
    Interpreter(scene).run_text(f"REACH 0 20 LEFT AT {x} {y} {z} WITH INDEX")
    (attempt,) = scene.attempts
    assert attempt.status == "CONVERGED"
    assert not attempt.values["pierced_faces"], attempt.message
    covering, arm = cover(actor), arm_of(actor.skeleton, "left")
    for skin in covering.deform(stage(actor, np.arange(0.0, 20.1, 0.5), scene.rate)):
        assert not len(pierced_faces(covering, arm, skin))


def test_every_frame_of_a_way_is_looked_at(anny: Scene) -> None:
    scene = _fresh(anny)
    actor = scene.actor()
    arm = arm_of(actor.skeleton, "left")
    looked = pierced_frames(scene, actor, cover(actor), arm, 1.5, 6.0)
    assert list(looked) == [1.5, 2.0, 3.0, 4.0, 5.0, 6.0]


@pytest.mark.slow
def test_a_body_takes_an_object_with_its_arm(anny: Scene) -> None:
    scene = _fresh(anny)
    Interpreter(scene).run_text("OBJECT APPLE BALL 0.07 AT 0.25 0.3 0.4\nGRASP 0 40 LEFT APPLE AUTO")
    (attempt,) = scene.attempts
    assert attempt.status == "CONVERGED"
    assert len(attempt.values["digits"]) >= 3
    actor = scene.actor()
    assert not actor.placement.tracks, "the body stays where it is"
    rest, taken = (stage(actor, np.array([frame]), scene.rate) for frame in (0.0, 40.0))
    for joint in ("pelvis", "head", "left.ankle", "right.ankle", "right.wrist"):
        k = actor.skeleton.index(joint)
        np.testing.assert_allclose(taken.positions[0, k], rest.positions[0, k], atol=1e-12)
    skin = cover(actor).deform(taken)[0]
    distance = np.linalg.norm(skin - np.array([0.25, 0.3, 0.4]), axis=1) - 0.035
    assert -2e-3 < distance.min() < 1e-3


def test_an_object_out_of_the_arms_reach_is_refused(anny: Scene) -> None:
    scene = _fresh(anny)
    with pytest.raises(InputError, match=r"cannot take APPLE where it stands: its arm is \d+ mm short"):
        Interpreter(scene).run_text("OBJECT APPLE BALL 0.07 AT 0.3 0.3 2.0\nGRASP 0 40 LEFT APPLE AUTO TRIES 32")
