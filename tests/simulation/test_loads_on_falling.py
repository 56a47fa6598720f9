"""Loads on what falls: forces and moments as mechanics has them; what begins inside; what bears (R97, R139)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.grasp import Places, make_object
from warpjld.grasp.shapes import box
from warpjld.motion import Key, Track
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.rigid_load import rigid_load
from warpjld.simulation.object_loads import ObjectLoad, ObjectSpin
from warpjld.simulation.recorded import RecordedAnimation, RecordedObject
from warpjld.simulation.simulate import Simulation
from warpjld.simulation.solve.falling import Falls, falling_names, follow_falls
from warpjld.simulation.specification import ContactSpecification, ObjectMaterial, SolveSpecification
from warpjld.simulation.state_variables import Points

DENSITY, SIDES = 1000.0, (0.1, 0.01, 0.02)
MASS = DENSITY * SIDES[0] * SIDES[1] * SIDES[2]
SPINNING = (
    "RATE 30\nFRAMES 0 30\nGRAVITY 0 -9.81 0\nOBJECT FLOOR BOX 0.6 0.02 0.6 AT 0 -0.01 0\n"
    "OBJECT ROD BOX 0.1 0.01 0.01 AT 0 {} 0\nPHYSICAL ROD OF RUBBER ELEMENT 0.01\n"
    "{}SPIN ROD Y AT 0 5\nPRESS 0 30 EVERY 15\n"
)


def run(text: str) -> Simulation:
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(text)
    return run_contact(scene, Path())


def keyed(**values: float) -> dict[str, Track]:
    """A track a channel, with a value from frame 0 on."""
    tracks = {channel: Track(channel) for channel in values}
    for channel, value in values.items():
        tracks[channel].set(Key(0.0, value))
    return tracks


def loaded(kind: str, points: Points, **values: float) -> ContactSpecification:
    """A bar in the air with a load."""
    load = ObjectLoad(kind, points, keyed(**values))  # type: ignore[arg-type]
    matter = {"bar": ObjectMaterial(density=DENSITY)}
    return ContactSpecification(physical=matter, loads={("bar", "p", kind): load}, gravity=(0.0, -9.81, 0.0))


def fall(contact: ContactSpecification, height: float = 1.0, last: int = 5, floor: float = -10.0) -> Falls:
    things = [
        RecordedObject("bar", box(*SIDES), np.array([[0.0, height, 0.0]])),
        RecordedObject("floor", box(20.0, 0.02, 20.0), np.array([[0.0, floor, 0.0]])),
    ]
    request = SolveSpecification(0, last)
    animation = RecordedAnimation(objects=things)
    return follow_falls(animation, contact, request, falling_names(contact, request))


ALL, END = Points(), Points("upper", 0)


@pytest.mark.parametrize(
    ("kind", "points", "value", "force"),
    [
        ("force", ALL, {"x": 0.3, "y": 0.0, "z": 0.0}, (0.3, 0.0, 0.0)),
        ("traction", END, {"x": 500.0, "y": 0.0, "z": 0.0}, (500.0 * SIDES[1] * SIDES[2], 0.0, 0.0)),
        ("pressure", END, {"pressure": 500.0}, (-500.0 * SIDES[1] * SIDES[2], 0.0, 0.0)),
        ("pressure", ALL, {"pressure": 500.0}, (0.0, 0.0, 0.0)),
    ],
)
def test_a_load_through_the_centre_adds_to_gravity(kind: str, points: Points, value: dict, force: tuple) -> None:
    """x(t) = x(0) + (g + F / m) t² / 2, exactly."""
    path = fall(loaded(kind, points, **value)).paths["bar"]
    seconds = path.frames[-1] / 30.0
    moved = path.places[-1].position[0] - path.places[0].position[0]
    gain = np.array([0.0, -9.81, 0.0]) + np.array(force) / MASS
    assert moved == pytest.approx(0.5 * gain * seconds**2, abs=1e-9)


def test_a_force_at_an_end_turns_the_bar() -> None:
    contact = loaded("force", END, x=0.0, y=0.0, z=0.002)
    thing = box(*SIDES)
    shape = rigid_shape("bar", thing, contact.physical["bar"])
    load = rigid_load(contact, "bar", thing)
    assert load is not None
    found = load.at(RigidBody(shape, Places.of((1.0, 2.0, 3.0))), 0.0)
    assert found == pytest.approx([0.0, 0.0, 0.002, 0.0, -0.05 * 0.002, 0.0], abs=1e-12)
    angle = np.linalg.norm(fall(contact).paths["bar"].places[-1].rotation[0][:3]) * 2.0
    inertia = MASS * (SIDES[0] ** 2 + SIDES[2] ** 2) / 12.0
    assert angle == pytest.approx(0.5 * 0.05 * 0.002 / inertia * (5 / 30) ** 2, rel=0.03)  # the steps' error is h / t


def test_a_rotation_pulls_away_from_its_axis() -> None:
    """m ω² r outward; no moment about a principal axis."""
    contact = ContactSpecification(
        physical={"bar": ObjectMaterial(density=DENSITY)},
        spins={"bar": ObjectSpin((0.0, 2.0, 0.0), (0.3, 5.0, 0.0), keyed(spin=4.0)["spin"])},
    )
    load = rigid_load(contact, "bar", box(*SIDES))
    assert load is not None
    body = RigidBody(rigid_shape("bar", box(*SIDES), contact.physical["bar"]), Places.of((0.0, 0.0, 0.0)))
    assert load.at(body, 0.0) == pytest.approx([-MASS * 16.0 * 0.3, 0, 0, 0, 0, 0], abs=1e-12)


def test_points_on_a_surface_of_few_triangles_are_found() -> None:
    """A pressure on a patch of a box of 12 triangles: none of them lies in the patch."""
    import trimesh

    mesh = trimesh.creation.box(SIDES)
    thing = make_object("bar", np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32))
    contact = loaded("pressure", Points("near", centre=(0.0, 0.005, 0.0), radius=0.012), pressure=1000.0)
    load = rigid_load(contact, "bar", thing)
    assert load is not None
    body = RigidBody(rigid_shape("bar", thing, contact.physical["bar"]), Places.of((0.0, 0.0, 0.0)))
    force = load.at(body, 0.0)
    assert -1000.0 * np.pi * 0.012**2 < force[1] < -1000.0 * 0.3 * np.pi * 0.012**2
    assert force[[0, 2]] == pytest.approx(0.0, abs=1e-9)


def test_points_without_a_face_are_named() -> None:
    contact = loaded("pressure", Points("near", centre=(0.05, 1.005, 0.01), radius=1e-3), pressure=1.0)
    with pytest.raises(InputError, match="bar: points p: no face of the surface lies between them"):
        fall(contact)


def test_a_rotation_of_what_falls_is_refused_and_of_what_stands_is_not() -> None:
    """It was ignored, or moved to the floor at once."""
    with pytest.raises(InputError, match=r"SPIN ROD: nothing holds ROD.*HOLD points of it") as told:
        run(SPINNING.format(0.15, ""))
    assert told.value.line == 7
    found = run(SPINNING.format(0.005, ""))
    assert found.verdict.status == "CONVERGED"
    held = "POINTS ROD E LOWER X 0\nHOLD ROD E 5\n"
    found = run(SPINNING.format(0.05, held))
    assert "SPIN of ROD does not act while it falls" in found.verdict.text


def test_what_begins_inside_is_said_to_be_pushed_out() -> None:
    contact = ContactSpecification(physical={"bar": ObjectMaterial()}, gravity=(0.0, -9.81, 0.0))
    path = fall(contact, height=0.012, last=20, floor=0.0).paths["bar"]  # 3 mm inside
    said = path.summary()
    assert "bar begins 3 mm inside floor at frame 0" in said
    assert "pushed out" in said
    assert "frame -0" not in said
    assert path.rests is not None
    assert path.places[-1].position[0, 1] == pytest.approx(0.015, abs=1e-4)


def test_what_lies_on_top_bears_nothing() -> None:
    matter = {name: ObjectMaterial() for name in ("low", "high")}
    contact = ContactSpecification(physical=matter, gravity=(0.0, -9.81, 0.0))
    things = [
        RecordedObject("low", box(0.05, 0.03, 0.05), np.array([[0.0, 0.030, 0.0]])),
        RecordedObject("high", box(0.04, 0.03, 0.04), np.array([[0.0, 0.065, 0.0]])),
        RecordedObject("floor", box(0.5, 0.02, 0.5), np.array([[0.0, 0.0, 0.0]])),
    ]
    paths = follow_falls(RecordedAnimation(objects=things), contact, SolveSpecification(0, 20), ["low", "high"]).paths
    assert paths["low"].on == ("floor",)
    assert paths["high"].on == ("low",)
