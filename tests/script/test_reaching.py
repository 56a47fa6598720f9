"""REACH in scripts: the skin of the hand is where it was asked, and what does not go is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp.palm import palm_of
from warpjld.io import load_rig
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.binding import cover
from warpjld.script.staging import stage


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
