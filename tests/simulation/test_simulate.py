"""The simulation in Python, without a script: arrays in, arrays out."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from warpjld.errors import InputError
from warpjld.grasp.shapes import box
from warpjld.rig import Rig
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import SceneAnimation, run_contact
from warpjld.simulation.recorded import RecordedActor, RecordedAnimation, RecordedObject
from warpjld.simulation.simulate import Simulation, simulate
from warpjld.simulation.specification import (
    ContactSpecification,
    FleshMaterial,
    GripSpecification,
    ObjectMaterial,
    SolveSpecification,
)
from warpjld.simulation.state_variables import Points, PrescribedPoints
from warpjld.skeleton import Poses, poses_from_angles

EDGE, YOUNG, DEPTH = 0.02, 1e5, 5e-4


@pytest.fixture(scope="module")
def pressed() -> Simulation:
    """A block whose top is held, and a plate that rises against it by half a millimetre from frame 1 to frame 2."""
    block = RecordedObject("block", box(EDGE, EDGE, EDGE), positions=(0.0, 0.5 * EDGE + 1e-4, 0.0))
    rises = np.array([[0.0, -0.01, 0.0], [0.0, -0.01 + 1e-4, 0.0], [0.0, -0.01 + 1e-4 + DEPTH, 0.0]])
    plate = RecordedObject("plate", trimesh.creation.box((0.1, 0.02, 0.1)), positions=rises)
    contact = ContactSpecification(
        physical={"block": ObjectMaterial("linear", YOUNG, 0.0, element=0.01)},
        prescribed={("block", "top"): PrescribedPoints(Points("upper", 1, 0.0), held=True)},
        everywhere=0.0,
        pressing=SolveSpecification(0, 2),
    )
    return simulate(contact, RecordedAnimation(objects=[block, plate]))


def test_a_block_answers_as_a_spring(pressed: Simulation) -> None:
    assert pressed.verdict.status == "CONVERGED"
    assert pressed.frames[-1] == 2.0
    count = len(pressed.model.body.mesh.nodes)
    assert pressed.displacement.shape == (len(pressed.frames), count, 3)
    assert pressed.pressure.shape == (len(pressed.frames), count)
    force = pressed.force("block")[-1]
    np.testing.assert_allclose(force, [0.0, YOUNG * EDGE**2 * DEPTH / EDGE, 0.0], rtol=0.02, atol=1e-6)


def test_pressure_on_the_visible_surface_sums_to_the_force(pressed: Simulation) -> None:
    found = pressed.visible_pressure("block", 2.0)
    x = found.vertices[found.triangles]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    total = float(area @ found.pressure[found.triangles].mean(axis=1))
    assert total == pytest.approx(pressed.force("block")[-1, 1], rel=1e-3)


def test_what_cannot_be_is_refused_by_name(pressed: Simulation) -> None:
    with pytest.raises(InputError, match="name: nothing called plate deforms here; there are block"):
        pressed.force("plate")
    with pytest.raises(InputError, match="frame: want one of"):
        pressed.visible_pressure("block", 7.0)
    with pytest.raises(InputError, match=r"last: want a frame after the first \(3\), got 3"):
        SolveSpecification(3, 3)
    with pytest.raises(InputError, match=r"element: want a number above 0, got -1.0"):
        FleshMaterial(element=-1.0)
    with pytest.raises(InputError, match=r"digits: want of .* and palm, got \['toe'\]"):
        FleshMaterial(("toe",))
    nothing = RecordedAnimation()
    with pytest.raises(InputError, match=r"friction: want coefficients of 0 or more, got -0.5"):
        simulate(ContactSpecification(everywhere=-0.5, pressing=SolveSpecification(0, 1)), nothing)
    with pytest.raises(InputError, match="specification: want pressing set"):
        simulate(ContactSpecification(), nothing)
    asked = ContactSpecification(physical={"ball": ObjectMaterial()}, pressing=SolveSpecification(0, 1))
    with pytest.raises(InputError, match="there is no object ball; there are none"):
        simulate(asked, nothing)


def test_names_that_differ_by_case_alone_are_refused() -> None:
    """Face sets of hands are called in lower case: whoever is called Lid and lid would be one."""
    lids = [
        RecordedObject(name, box(EDGE, EDGE, EDGE), positions=(k, 0.0, 0.0)) for k, name in enumerate(("Lid", "lid"))
    ]
    solid = ObjectMaterial(element=0.01)
    contact = ContactSpecification(physical={"Lid": solid, "lid": solid}, pressing=SolveSpecification(0, 1))
    with pytest.raises(InputError, match="two bodies are called lid"):
        simulate(contact, RecordedAnimation(objects=lids))


def test_a_grip_of_recorded_poses_is_refused(rig: Rig) -> None:
    flat = poses_from_angles(rig.skeleton, np.zeros((2, len(rig.skeleton), 4)))
    grip = GripSpecification("LEFT", "", 1, 2, ("left.index.base.flexion",), most=0.1, force=1.0)
    contact = ContactSpecification(
        flesh={"LEFT": FleshMaterial(digits=("index",))}, grips=(grip,), pressing=SolveSpecification(0, 2)
    )
    with pytest.raises(InputError, match="LEFT is driven by recorded poses: a grip search needs joint angles"):
        simulate(contact, RecordedAnimation([RecordedActor("LEFT", rig, poses=flat)]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"force": None}, "a grip needs a force, or lift=True"),
        ({"share": "force"}, "share: want 'muscles', of the force of a grip that does not lift, got 'force'"),
        ({"share": "muscles", "lift": True}, "that does not lift, got 'muscles'"),
        ({"share": "muscles", "digits": ("ring",)}, "digits: ring does not close here; index do"),
    ],
)
def test_grips_that_make_no_sense_are_refused(rig: Rig, change: dict[str, Any], message: str) -> None:
    grip = GripSpecification("LEFT", "", 1, 2, ("left.index.base.flexion",), most=0.1, force=1.0)
    contact = ContactSpecification(
        flesh={"LEFT": FleshMaterial()}, grips=[replace(grip, **change)], pressing=SolveSpecification(0, 2)
    )
    flat = np.zeros((3, len(rig.skeleton), 4))
    with pytest.raises(InputError, match=message):
        simulate(contact, RecordedAnimation([RecordedActor("LEFT", rig, angles=flat)]))


@pytest.mark.slow
def test_poses_of_a_script_press_as_the_script_does(fine: Rig, tmp_path: Path) -> None:
    """A fingertip on a plate, once from a script and once from arrays of its poses."""
    scene = Scene(say=lambda text: None)
    scene.add("left", fine)
    Interpreter(scene).run_text(
        "OBJECT plate BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165\nMOVE LEFT 0 0 0.002 0\nMOVE LEFT 6 0 -0.006 0\n"
        "FLESH LEFT INDEX ELEMENT 0.004\nPRESS 0 6 EVERY 2"
    )
    actor = SceneAnimation(scene).actors["LEFT"]
    poses = [actor.pose(float(frame)) for frame in range(7)]
    arrays = Poses(*(np.concatenate([getattr(one, f.name) for one in poses]) for f in fields(Poses)))
    hand = RecordedActor("LEFT", fine, poses=arrays, covering=actor.covering)
    plate = RecordedObject("PLATE", scene.prop("plate").thing, positions=(0.034, -0.0275, -0.165))
    found = simulate(scene.contact, RecordedAnimation([hand], [plate]))
    asked = run_contact(scene, tmp_path)
    assert found.verdict.status == "CONVERGED"
    np.testing.assert_array_equal(found.frames, asked.frames)
    np.testing.assert_allclose(found.force("LEFT"), asked.force("LEFT"), rtol=1e-3, atol=1e-4)
    assert np.linalg.norm(found.force("LEFT")[-1]) > 0.1
    assert [row.digit for row in found.rows] == [row.digit for row in asked.rows]
    assert found.tactile("LEFT").touching.any()
