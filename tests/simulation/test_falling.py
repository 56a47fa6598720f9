"""What nothing holds: it falls, slides, rolls and comes to rest as mechanics has it, or leaves the stage."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem.contact.obstacles.obstacle import Obstacle
from warpjld.fem.contact.obstacles.solids import Box, Plane
from warpjld.grasp import Places
from warpjld.grasp.shapes import ball, box
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import SceneAnimation, run_contact
from warpjld.simulation.fall.impulses import impulses
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.time_stepping import step_bodies
from warpjld.simulation.recorded import RecordedAnimation, RecordedObject
from warpjld.simulation.simulate import Simulation
from warpjld.simulation.solve.falling import falling_names, follow_falls
from warpjld.simulation.solve.falling_stage import FallingStage
from warpjld.simulation.specification import ContactSpecification, ObjectMaterial, SolveSpecification

G = np.array([0.0, -9.81, 0.0])
STEP = 1.0 / 240.0
TILT = np.radians(25.0)


def steps(bodies: list[RigidBody], obstacles: dict[str, Obstacle], friction: float, seconds: float) -> NDArray:
    """Energy after each step [J]."""
    energy = [sum(one.energy(G) for one in bodies)]
    for k in range(round(seconds / STEP)):
        step_bodies(bodies, obstacles, G, lambda a, b: friction, time=float(k), step=1.0, length=STEP)
        energy.append(sum(one.energy(G) for one in bodies))
    return np.array(energy)


def on_slope() -> tuple[RigidBody, dict[str, Obstacle]]:
    """A box on a plate that is tilted by 25°."""
    turn = Rotation.from_rotvec((0.0, 0.0, TILT))
    plate = Box((2.0, 0.01, 0.1), (0.0, 0.0, 0.0), 1e-3, lambda time: ((0.0, 0.0, 0.0), turn.as_quat()))
    shape = rigid_shape("box", box(0.03, 0.03, 0.03), ObjectMaterial())
    up = turn.apply((0.0, 0.005 + 0.015 + 1e-5, 0.0))
    return RigidBody(shape, Places.of(up, turn.as_quat())), {"plate": plate}


def bowl(radius: float = 0.06, wall: float = 0.005) -> trimesh.Trimesh:
    """A spherical bowl with its rim above, its lowest inner point ``radius`` below the origin."""
    profile = np.linspace(0.0, 0.45 * np.pi, 24)
    profile = np.concatenate([np.stack([np.sin(profile), -np.cos(profile)], axis=1)])
    points = np.concatenate([radius * profile, (radius + wall) * profile[::-1]])
    return trimesh.creation.revolve(
        points, sections=32, transform=trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0))
    )


def test_the_mass_of_solid_and_hollow_balls() -> None:
    solid = rigid_shape("a", ball(0.1), ObjectMaterial(density=500.0))
    shell = rigid_shape("b", ball(0.1), ObjectMaterial(density=500.0, wall=0.001))
    assert solid.mass == pytest.approx(500.0 * 4.0 / 3.0 * np.pi * 0.05**3, rel=0.005)
    assert shell.mass == pytest.approx(500.0 * 0.001 * 4.0 * np.pi * 0.05**2, rel=0.005)
    assert np.diag(solid.inertia) == pytest.approx(0.4 * solid.mass * 0.05**2 * np.ones(3), rel=0.01)
    assert np.diag(shell.inertia) == pytest.approx(2.0 / 3.0 * shell.mass * 0.05**2 * np.ones(3), rel=0.01)


def test_in_the_air_it_is_a_parabola_and_energy_stays() -> None:
    body = RigidBody(rigid_shape("box", box(0.02, 0.03, 0.05), ObjectMaterial()), Places.of((0.0, 1.0, 0.0)))
    body.velocity = np.array([1.0, 2.0, 0.0])
    energy = steps([body], {}, 0.5, 0.5)
    assert body.centre == pytest.approx([0.5, 1.0 + 2.0 * 0.5 - 0.5 * 9.81 * 0.25, 0.0], abs=1e-9)
    assert np.ptp(energy) < 1e-12


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.45])
def test_a_box_slides_as_coulomb_has_it(friction: float) -> None:
    body, stage = on_slope()
    energy = steps([body], stage, friction, 0.5)
    acceleration = 9.81 * (np.sin(TILT) - friction * np.cos(TILT))
    assert np.linalg.norm(body.velocity) == pytest.approx(acceleration * 0.5, rel=1e-3)
    assert np.diff(energy).max() < 1e-7  # what overlaps by rounding is parted: a lift of a millionth of a millimetre


def test_a_box_stays_where_friction_is_enough() -> None:
    body, stage = on_slope()
    before = body.centre.copy()
    steps([body], stage, 0.5, 0.5)
    assert np.linalg.norm(body.centre - before) < 1e-5


def test_a_ball_rolls_without_sliding() -> None:
    turn = Rotation.from_rotvec((0.0, 0.0, TILT))
    body = RigidBody(rigid_shape("ball", ball(0.04), ObjectMaterial()), Places.of(turn.apply((0.0, 0.02, 0.0))))
    steps([body], {"plane": Plane((0.0, 0.0, 0.0), turn.apply((0.0, 1.0, 0.0)))}, 0.6, 0.3)
    lowest = body.middle - 0.02 * turn.apply((0.0, 1.0, 0.0))
    assert np.linalg.norm(body.moving(lowest[None])) < 1e-3 * np.linalg.norm(body.velocity)


def test_boxes_stand_on_one_another() -> None:
    shape = rigid_shape("box", box(0.03, 0.03, 0.03), ObjectMaterial())
    bodies = [RigidBody(shape, Places.of((0.004 * k, 0.0151 + 0.0301 * k, 0.0))) for k in range(2)]
    energy = steps(bodies, {"floor": Plane()}, 0.5, 0.2)
    assert [one.middle[1] for one in bodies] == pytest.approx([0.015, 0.045], abs=1e-4)
    assert bodies[1].middle[0] == pytest.approx(0.004, abs=1e-4)
    assert np.diff(energy).max() < 1e-6


def test_impulses_hold_the_laws_of_contact() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        root = rng.normal(size=(6, 6))
        delassus, free = root @ root.T + np.eye(6), rng.normal(size=6)
        found = impulses(delassus, free, np.zeros(2), np.array([0.4, 0.0]))
        after = delassus @ found + free
        normal, tangent = found[::3], found.reshape(2, 3)[:, 1:]
        assert (normal >= 0.0).all()
        assert (after[::3] > -1e-4).all()
        assert np.abs(normal * after[::3]).max() < 1e-4
        assert np.linalg.norm(tangent[0]) <= 0.4 * normal[0] + 1e-9
        assert not tangent[1].any()


def drop(things: dict[str, RecordedObject], last: int, friction: float = 0.5) -> dict:
    """Paths of the first of some objects."""
    name = next(iter(things))
    contact = ContactSpecification(physical={name: ObjectMaterial()}, everywhere=friction, gravity=tuple(G))
    request = SolveSpecification(0, last)
    animation = RecordedAnimation(objects=things.values())
    return follow_falls(animation, contact, request, falling_names(contact, request)).paths


def test_a_ball_dropped_into_a_bowl_rests_at_its_bottom() -> None:
    things = {
        "ball": RecordedObject("ball", ball(0.02), positions=(0.03, 0.0, 0.01)),
        "bowl": RecordedObject("bowl", bowl()),
    }
    path = drop(things, 110)["ball"]
    assert path.rests is not None
    assert path.on == ("bowl",)
    middle = path.places[-1].position[0]
    assert np.linalg.norm(middle - [0.0, -0.05, 0.0]) < 1e-3
    assert "comes to rest on bowl" in path.summary()


def test_what_has_nothing_below_leaves_the_stage() -> None:
    things = {
        "ball": RecordedObject("ball", ball(0.02), positions=(0.2, 0.1, 0.0)),
        "table": RecordedObject("table", box(0.1, 0.02, 0.1)),
    }
    path = drop(things, 30)["ball"]
    assert path.left is not None
    assert path.rests is None
    assert "leaves the stage" in path.summary()


def run(text: str) -> tuple[Scene, Simulation]:
    from pathlib import Path

    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(text)
    return scene, run_contact(scene, Path())


def test_a_script_of_objects_alone() -> None:
    _, found = run(
        "OBJECT TABLE BOX 0.1 0.02 0.1 AT 0 -0.01 0\nOBJECT BLOCK BOX 0.03 0.03 0.03 AT 0 0.02 0\n"
        "PHYSICAL BLOCK YOUNG 200000 ELEMENT 0.015\nGRAVITY 0 -9.81 0\nFRAMES 0 20\nPRESS 0 20 EVERY 10\n"
    )
    assert found.verdict.status == "CONVERGED"
    assert "BLOCK is held by nothing: it falls from frame 0 on, and comes to rest on TABLE" in found.verdict.text
    assert found.force("BLOCK")[-1] == pytest.approx([0.0, 1000.0 * 0.03**3 * 9.81, 0.0], rel=1e-3, abs=1e-4)


def test_an_interrupted_fall_keeps_its_whole_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (
        "OBJECT TABLE BOX 0.1 0.02 0.1 AT 0 -0.01 0\nOBJECT BLOCK BOX 0.03 0.03 0.03 AT 0 0.5 0\n"
        "PHYSICAL BLOCK YOUNG 200000 ELEMENT 0.03\nGRAVITY 0 -9.81 0\nFRAMES 0 9\nPRESS 0 9\n"
    )
    step, last = FallingStage._frame, 9.0

    def until(stage: FallingStage, before: float, after: float, solids: dict[str, Obstacle]) -> None:
        step(stage, before, after, solids)  # the frame in which Ctrl-C comes has moved what falls
        if after > last:
            raise KeyboardInterrupt

    monkeypatch.setattr(FallingStage, "_frame", until)
    whole, last = run(text)[1], 4.0
    found = run(text)[1]
    assert found.solved.interrupted
    assert found.verdict.status == "STOPPED"
    assert found.verdict.text.startswith("interrupted after frame 4; BLOCK is held by nothing: it falls from frame 0")
    for frame in (0, 2, 4):
        shown, wanted = (one.surfaces.object("BLOCK", frame) for one in (found, whole))
        assert shown is not None
        np.testing.assert_array_equal(shown, wanted)
    assert not np.array_equal(found.surfaces.object("BLOCK", 9), whole.surfaces.object("BLOCK", 9))
    last = 0.0
    with pytest.raises(KeyboardInterrupt):
        run(text)


def test_what_is_let_go_falls() -> None:
    scene, found = run(
        "OBJECT TABLE BOX 0.1 0.02 0.1 AT 0 -0.01 0\nOBJECT BLOCK BOX 0.03 0.03 0.03 AT 0 0.05 0\n"
        "PHYSICAL BLOCK YOUNG 200000 ELEMENT 0.03\nGRAVITY 0 -9.81 0\nFRAMES 0 20\n"
        "POINTS BLOCK TOP UPPER Y 0.05\nHOLD BLOCK TOP 5\nPRESS 0 20 EVERY 20\n"
    )
    assert found.verdict.status == "RELEASED"
    assert not found.verdict.failed
    assert "nothing holds 'BLOCK'" in found.verdict.text
    assert "it falls from frame 5 on, and comes to rest on TABLE" in found.verdict.text
    shape = found.surfaces.object("BLOCK", 20.0)
    assert shape is not None
    assert shape[:, 1].min() == pytest.approx(0.0, abs=1e-4)
    assert found.surfaces.object("BLOCK", 7.0)[:, 1].min() == pytest.approx(0.035 - 0.5 * 9.81 / 225.0, abs=1e-4)
    assert list(SceneAnimation(scene).objects) == ["TABLE", "BLOCK"]
    # contact goes on where it rests: the table bears its weight
    assert found.frames.tolist() == [5.0, 8.0, 20.0]
    assert found.force("BLOCK")[-1] == pytest.approx([0.0, 1000.0 * 0.03**3 * 9.81, 0.0], rel=1e-3, abs=1e-4)


@pytest.mark.slow
def test_bonded_pieces_that_are_let_go_fall_as_one_and_part_on_impact() -> None:
    """HOLD of one of two pieces ends at frame 3; the impact on the floor opens their bond. None lies in the other."""
    _, found = run(
        "RATE 30\nFRAMES 0 12\nGRAVITY 0 -9.81 0\nFRICTION 0.4\nOBJECT FLOOR BOX 0.40 0.02 0.30 AT 0 -0.01 0\n"
        "OBJECT BAR BOX 0.12 0.02 0.02 AT 0 0.05 0\nPHYSICAL BAR YOUNG 1e6 POISSON 0.3 ELEMENT 0.02\n"
        "PIECES BAR 2 BOND 30000\nPOINTS BAR_1 TOP UPPER Y 0.05\nHOLD BAR_1 TOP 3\nPRESS 0 12 EVERY 3\n"
    )
    assert found.verdict.status == "RELEASED"
    assert not found.verdict.failed
    assert "nothing holds 'BAR_1' and 'BAR_2'" in found.verdict.text
    assert "BAR_1 and BAR_2 are held by nothing: they fall from frame 3 on" in found.verdict.text
    # from the height at which it hung: 0.03 m above the floor or a little less, as it sags
    assert "the bond of BAR_1 and BAR_2 opens at frame 5." in found.verdict.text
    one, other = (found.surfaces.object(name, 12.0) for name in ("BAR_1", "BAR_2"))
    assert one is not None
    assert other is not None
    for shape in (one, other):
        assert shape[:, 1].min() == pytest.approx(0.0, abs=1e-4)
    assert one[:, 0].max() < other[:, 0].min() + 1e-4


SLAB = (
    "RATE 30\nFRAMES 0 35\nGRAVITY 0 -9.81 0\nFRICTION {friction}\nOBJECT FLOOR BOX 0.6 0.02 0.3 AT 0 -0.01 0\n"
    "OBJECT SLAB BOX 0.12 0.02 0.08 AT 0 0.06 0 TURN 0 0 20\n"
    "OBJECT CUBE BOX 0.03 0.03 0.03 AT -0.0114 0.0930 0 TURN 0 0 20\n"
    "PHYSICAL SLAB YOUNG 50000 ELEMENT 0.02\nPHYSICAL CUBE YOUNG 200000 ELEMENT 0.015\nPOINTS SLAB FOOT LOWER Y 0.05\n"
    "HOLD SLAB FOOT\nPOINTS CUBE TOP UPPER Y 0.05\nHOLD CUBE TOP 3\nPRESS 0 35 EVERY 35\n"
)


@pytest.mark.slow
def test_what_is_let_go_lies_on_a_soft_slope_by_friction() -> None:
    """On a slab tilted by 20° (tan 20° = 0.36) with μ = 0.5, which gives way under it."""
    _, found = run(SLAB.format(friction=0.5))
    weight = 1000.0 * 0.03**3 * 9.81
    assert found.verdict.status == "RELEASED"
    assert "comes to rest on SLAB at frame" in found.verdict.text
    assert found.force("CUBE")[-1] == pytest.approx([0.0, weight, 0.0], rel=1e-3, abs=1e-3 * weight)
    cube, slab = found.surfaces.object("CUBE", 35.0), found.surfaces.object("SLAB", 35.0)
    assert cube is not None
    assert slab is not None
    # pressed alone by the mean pressure, a column 20 mm high below the cube gives way by p h / E; the slab around helps
    pressed = weight * np.cos(np.radians(20.0)) / 0.03**2 * 0.02 / 5e4
    normal = np.array([-np.sin(np.radians(20.0)), np.cos(np.radians(20.0)), 0.0])
    sunk = 0.025 - float((cube.mean(axis=0) - [0.0, 0.06, 0.0]) @ normal)
    assert 0.3 * pressed < sunk < 1.1 * pressed


@pytest.mark.slow
def test_a_finger_presses_on_while_something_falls() -> None:
    """A block that is let go beside the finger changes nothing for it."""
    text = (
        "HAND LEFT BUILTIN\nFRAMES 0 20\nRATE 10\nGRAVITY 0 -9.81 0\nMOVE LEFT 0 0 0.003 0\nMOVE LEFT 20 0 -0.0063 0\n"
        "OBJECT PLATE BOX 0.036 0.006 0.036 AT 0.034 -0.0275 -0.165\n"
        "OBJECT TABLE BOX 0.08 0.01 0.08 AT 0.1 -0.1 -0.165\n"
        "FLESH LEFT INDEX ELEMENT 0.005\nFRICTION 0.6\n{falling}PRESS 0 20 EVERY 5\n"
    )
    falling = (
        "OBJECT CUBE BOX 0.03 0.03 0.03 AT 0.1 -0.02 -0.165\nPHYSICAL CUBE YOUNG 200000 ELEMENT 0.03\n"
        "POINTS CUBE TOP UPPER Y 0.05\nHOLD CUBE TOP 5\n"
    )
    alone, both = (run(text.format(falling=one))[1] for one in ("", falling))
    assert both.verdict.status == "RELEASED"
    assert both.frames.tolist() == [5.0, 7.0, 10.0, 15.0, 20.0]
    assert both.force("LEFT")[-1] == pytest.approx(alone.force("LEFT")[-1], rel=1e-2, abs=1e-3)
    assert both.force("CUBE")[-1, 1] == pytest.approx(1000.0 * 0.03**3 * 9.81, rel=1e-3)


@pytest.mark.slow
def test_what_is_let_go_slides_off_a_soft_slope() -> None:
    """With μ = 0.2 it slides off the slab to the floor, which bears it. It has left the slab in its first frames."""
    _, found = run(SLAB.format(friction=0.2))
    weight = 1000.0 * 0.03**3 * 9.81
    assert found.verdict.status == "RELEASED"
    assert "comes to rest on FLOOR at frame" in found.verdict.text
    assert found.force("CUBE")[-1] == pytest.approx([0.0, weight, 0.0], rel=1e-3, abs=1e-3 * weight)
    assert not found.force("SLAB").any()
    assert found.surfaces.object("CUBE", 35.0)[:, 1].min() == pytest.approx(0.0, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "turned"),
    [("CYLINDER 0.06 0.1", "20 0 30"), ("BOX 0.04 0.06 0.03", "20 0 30"), ("BALL 0.06", "0 0 0")],
)
def test_soft_objects_lie_on_a_floor_as_they_fell(what: str, turned: str) -> None:
    """Where they come to rest as rigid bodies they are in equilibrium as soft ones, too, even if free to roll: the
    floor bears their weight, and they give way to it."""
    _, found = run(
        f"OBJECT FLOOR BOX 0.6 0.02 0.6 AT 0 -0.01 0\nOBJECT IT {what} AT 0 0.12 0 TURN {turned}\n"
        "PHYSICAL IT YOUNG 30000 DENSITY 500 ELEMENT 0.015\nGRAVITY 0 -9.81 0\nFRAMES 0 50\nPRESS 0 50 EVERY 50\n"
    )
    assert found.verdict.status == "CONVERGED"
    assert "comes to rest on FLOOR at frame" in found.verdict.text
    assert found.frames.tolist() == [50.0]
    pull = found.model.pull("IT").sum(axis=0)
    assert found.force("IT")[-1] == pytest.approx(-pull, rel=1e-3, abs=1e-3 * np.linalg.norm(pull))
    rested, lying = (found.surfaces.object("IT", frame) for frame in (found.solved.start, 50.0))
    assert rested is not None
    assert lying is not None
    assert lying[:, 1].min() == pytest.approx(0.0, abs=3e-4)
    assert 0.0 < rested[:, 1].mean() - lying[:, 1].mean() < 0.003


@pytest.mark.slow
def test_a_ball_at_rest_is_flattened_by_its_weight() -> None:
    """A soft ball that fell on a table is solved at rest: its height falls by Hertz's approach (Johnson 1985, §4.2)."""
    _, found = run(
        "OBJECT TABLE BOX 0.2 0.02 0.2 AT 0 -0.01 0\nOBJECT BALL BALL 0.06 AT 0 0.06 0\n"
        "PHYSICAL BALL YOUNG 20000 POISSON 0.45 ELEMENT 0.008\nGRAVITY 0 -9.81 0\nFRAMES 0 30\nPRESS 0 30 EVERY 30\n"
    )
    assert found.verdict.status == "CONVERGED"
    shape, weight = found.surfaces.object("BALL", 30.0), float(found.force("BALL")[-1, 1])
    assert shape is not None
    assert weight == pytest.approx(1000.0 * 4.0 / 3.0 * np.pi * 0.03**3 * 9.81, rel=0.04)  # of a ball with facets
    approach = (3.0 * weight / (4.0 * 2e4 / (1.0 - 0.45**2) * 0.03**0.5)) ** (2.0 / 3.0)
    assert 0.06 - np.ptp(shape[:, 1]) == pytest.approx(approach, rel=0.08)


def test_a_rate_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="rate: want frames a second above 0, got 0"):
        SolveSpecification(0, 10, rate=0.0)
