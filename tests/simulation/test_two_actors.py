"""Flesh of several actors, and of segments of a body (R105, R126, R138)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.hand.kept import kept_hand
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import SceneAnimation, run_contact
from warpjld.simulation.bodies.flesh_body import build_flesh_body
from warpjld.simulation.bodies.model import assemble_model
from warpjld.simulation.bodies.segment_surface import segment_surface
from warpjld.simulation.solve.bone_clearance import BoneClearance
from warpjld.simulation.solve.checks import check_model
from warpjld.simulation.solve.start_frame import find_start

PADS = """
TURN RIGHT 0 180 0 0
MOVE RIGHT 0 0.06793 -0.04094 -0.41785
MOVE LEFT 0 0 0 0
MOVE LEFT 4 0 -0.003 0
FLESH LEFT INDEX ELEMENT 0.004
FLESH RIGHT INDEX ELEMENT 0.004
FRAMES 0 4
PRESS 0 4 EVERY 2
"""
"""The right hand lies palm up under the left one, index under index, half a millimetre off."""


def hands(text: str = PADS) -> Scene:
    scene = Scene(say=lambda line: None)
    for side in ("left", "right"):
        scene.add(side, kept_hand(side, resolution=2500))
    Interpreter(scene).run_text(text)
    return scene


def arm(figure: Rig, text: str) -> Scene:
    scene = Scene(say=lambda line: None)
    scene.add("body", figure)
    Interpreter(scene).run_text(text)
    return scene


def test_contact_starts_before_two_hands_of_flesh_meet() -> None:
    """They come together at -0.5 mm, between frames 0 and 1: what is solved begins at 0, not at the frame before the
    last, where they would be at rest deep in each other."""
    scene = hands()
    pressing = scene.contact.pressing
    assert pressing is not None
    assert find_start(SceneAnimation(scene), scene.contact, pressing).start == 0.0
    apart = hands(PADS.replace("MOVE RIGHT 0 0.06793 -0.04094", "MOVE RIGHT 0 0.06793 -0.08094"))
    assert find_start(SceneAnimation(apart), apart.contact, pressing).start == 3.0  # nothing touches
    bending = replace(apart.contact, flesh={"LEFT": replace(apart.contact.flesh["LEFT"], flexion=True)})
    assert find_start(SceneAnimation(apart), bending, pressing).start == 0.0


@pytest.mark.slow
def test_index_pads_of_two_hands_press_each_other(tmp_path: Path) -> None:
    found = run_contact(hands(), tmp_path)
    assert found.verdict.status == "CONVERGED"
    one, other = found.force("LEFT")[-1], found.force("RIGHT")[-1]
    assert 0.2 < np.linalg.norm(one) < 2.0
    assert np.linalg.norm(one + other) < 1e-5 * np.linalg.norm(one)
    assert abs(one[1]) > 0.9 * np.linalg.norm(one)
    row = next(row for row in found.rows if (row.frame, row.actor, row.digit) == (4.0, "RIGHT", "index"))
    assert row.against == "LEFT"


@pytest.mark.slow
def test_hands_whose_bones_cross_at_the_start_are_refused() -> None:
    """One index 13 mm up into the other; 4 mm are a matter of pressure, and nothing is between bones that are apart."""
    left = {}
    for up in (0.0, 0.004, 0.013):
        scene = hands(PADS.replace("-0.04094", f"{up - 0.04094:.5f}"))
        actors = SceneAnimation(scene).actors
        bodies = [build_flesh_body(actors[name], flesh, 0.0)[0] for name, flesh in scene.contact.flesh.items()]
        model = assemble_model(bodies, [], {}, scene.contact)
        left[up] = min((bone.left for bone in BoneClearance(model).between_actors(model, 0.0)), default=1.0)
        if up == 0.013:
            with pytest.raises(InputError, match=r"the bone of \w+ index is .* mm inside the bones of .* farther"):
                check_model(model, scene.contact)
        else:
            check_model(model, scene.contact)
    assert left[0.0] == 1.0 > left[0.004] > 0.3
    assert left[0.013] < 0.0


@pytest.mark.slow
def test_the_skin_of_segments(figure: Rig) -> None:
    """Of a body's upper arm and forearm, a little more than theirs, and none of the trunk's that is near."""
    scene = arm(figure, "")
    staged = SceneAnimation(scene).actors["BODY"]
    part = segment_surface(staged.rig, staged.covering, ["left.upper_arm", "left.forearm"], 0.02)
    places = part.rig.surface.vertices
    np.testing.assert_array_equal(places, staged.rig.surface.vertices[part.vertices])
    skeleton = staged.rig.skeleton
    elbow, shoulder, wrist = (skeleton.rest[skeleton.index(f"left.{name}")] for name in ("elbow", "shoulder", "wrist"))
    assert places[:, 0].min() > shoulder[0] - 0.12
    assert places[:, 0].max() < wrist[0] + 0.12
    near = np.linalg.norm(staged.rig.surface.vertices - elbow, axis=1) < 0.06
    assert (part.share[near] == 1.0).all()
    assert (part.share[np.setdiff1d(np.arange(len(part.share)), part.vertices)] == 0.0).all()
    rim = np.linalg.norm(places - elbow, axis=1).argsort()[-20:]
    assert part.share[part.vertices[rim]].max() < 0.2


def test_segments_that_are_none(figure: Rig) -> None:
    with pytest.raises(InputError, match=r"1:12: there is no segment 'left\.foream'.*did you mean left\.forearm"):
        arm(figure, "FLESH BODY left.foream")
    with pytest.raises(InputError, match=r"no segment 'left\.shin'"):
        hands("FLESH LEFT left.shin")
    scene = arm(figure, "FLESH BODY left.upper_arm forearm ELEMENT 0.02 FLEXION")
    assert scene.contact.flesh["BODY"].segments == ("left.upper_arm", "forearm")
    assert scene.contact.flesh["BODY"].flexion


@pytest.mark.slow
def test_an_arm_of_flesh_bends(figure: Rig, tmp_path: Path) -> None:
    """By bending alone: flesh is strained, bones go where the covering's go, and far from the elbow its skin, too."""
    scene = arm(
        figure,
        "ELBOW LEFT FLEXION AT 0 0\nELBOW LEFT FLEXION AT 3 45\n"
        "FLESH BODY left.upper_arm left.forearm ELEMENT 0.02 FLEXION ITSELF OFF\nFRAMES 0 3\nPRESS 0 3\n",
    )
    found = run_contact(scene, tmp_path)
    assert found.verdict.status == "CONVERGED"
    assert found.frames.tolist() == [1.0, 2.0, 3.0]
    covered = SceneAnimation(scene).actors["BODY"].skin(3.0)
    shape = found.model.hands[0].deformed(found.displacement[-1], covered)
    away = np.linalg.norm(shape - covered, axis=1)
    hand = found.model.hands[0].shape
    assert away[hand.blend == 0.0].max() < 1e-6
    assert 1e-3 < away.max() < 0.05
    far = (hand.blend > 0.9) & (np.linalg.norm(covered - covered[away.argmax()], axis=1) > 0.12)
    assert np.median(away[far]) < 3e-3
