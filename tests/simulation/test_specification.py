"""What the words of contact leave in a scene, and what they refuse."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem.contact.obstacles.barr import Barr
from warpjld.fem.contact.obstacles.meshes import Keyframed
from warpjld.fem.contact.obstacles.solids import Box, Sphere
from warpjld.script.contact import SceneAnimation, write_keys
from warpjld.script.props import prop_places
from warpjld.script.staging import frame_numbers
from warpjld.simulation.animation import AngleEdit
from warpjld.simulation.state_variables import Points

READY = "OBJECT ball BALL 0.06 AT 0.1 0.2 0.3\nOBJECT table BOX 0.4 0.02 0.3\nPHYSICAL ball YOUNG 1e6"


def test_a_physical_ball(run) -> None:
    scene = run(READY + " POISSON 0.4 LAW MOONEY-RIVLIN HOLLOW 0.003 PRESSURE 20000 DENSITY 1100 ELEMENT 0.004")
    wish = scene.contact.physical["BALL"]
    assert (wish.law, wish.wall, wish.pressure, wish.density) == ("mooney-rivlin", 0.003, 20000, 1100)
    assert wish.material().young == pytest.approx(1e6)
    assert wish.material().poisson == pytest.approx(0.4)
    assert wish.where == ("<script>", 3, 1)


def test_flesh_friction_and_bonds(run) -> None:
    scene = run(
        READY + "\nOBJECT lid BOX\nPHYSICAL lid\nBOND ball lid 2e4\nFRICTION 0.3\nFRICTION table ball 0.8\n"
        "FLESH left INDEX THUMB ELEMENT 0.002 YOUNG 5e4 ITSELF OFF\nGRAVITY 0 -9.81 0"
    )
    wishes = scene.contact
    assert wishes.coefficient("BALL", "TABLE") == wishes.coefficient("TABLE", "BALL") == 0.8
    assert wishes.coefficient("LEFT", "BALL") == 0.3
    assert wishes.bond("LID", "BALL").shear == 2e4
    assert wishes.bond("LID", "TABLE") is None
    flesh = wishes.flesh["LEFT"]
    assert (flesh.digits, flesh.element, flesh.flesh, flesh.itself) == (("index", "thumb"), 0.002, 5e4, False)
    assert wishes.gravity == (0, -9.81, 0)


def test_state_variables_are_keyed_like_angles(run) -> None:
    scene = run(
        READY + "\nPOINTS ball top UPPER Y 0.1\nPOINTS ball foot NEAR 0.1 0.17 0.3 0.01\n"
        "VECTOR ball top 0 20 10 0 -0.01 0\nPARTIAL ball foot XZ AT 5 0.001 0.002\nHOLD ball foot"
    )
    top, foot = (scene.contact.prescribed["BALL", name] for name in ("TOP", "FOOT"))
    assert [key.frame for key in top.tracks["y"].keys] == [0, 10, 20]
    assert set(top.tracks) == {"x", "y", "z"}
    assert set(foot.tracks) == {"x", "z"}
    assert foot.held
    assert not top.held


def test_points_are_chosen() -> None:
    local = np.stack(np.meshgrid(*[np.linspace(0, 1, 11)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    assert len(Points().choose(local, local)) == 1331
    assert (local[Points("upper", 1, 0.1).choose(local, local), 1] >= 0.9 - 1e-9).all()
    assert (local[Points("lower", 2, 0.0).choose(local, local), 2] == 0).all()
    near = Points("near", centre=(5.0, 0.5, 0.5), radius=0.101).choose(local, local + np.array([4.5, 0.0, 0.0]))
    assert len(near) == 7
    with pytest.raises(InputError, match="no point of the object lies there"):
        Points("near", centre=(9, 9, 9), radius=0.1).choose(local, local)


def test_objects_move_and_turn_like_actors(run) -> None:
    scene = run(READY + "\nMOVE table 0 0 0 0\nMOVE table 30 0 0.1 0\nTURN table 0 0 0 0\nTURN table 30 0 90 0")
    assert frame_numbers(scene)[-1] == 30
    places = prop_places(scene.actors, scene.rate, scene.prop("table"), np.array([0.0, 30.0]))
    np.testing.assert_allclose(places.position, [[0, 0, 0], [0, 0.1, 0]], atol=1e-12)
    np.testing.assert_allclose(places.apply([[0.2, 0.0, 0.0]])[1], [[0, 0.1, -0.2]], atol=1e-12)


def test_formulas_deform_objects(run) -> None:
    lines = ("OBJECT rod BOX 0.02 0.2 0.02", "DEFORM rod BEND Y AT 0 0", "DEFORM rod BEND Y AT 10 180")
    scene = run("\n".join([*lines, "DEFORM rod TAPER Y AT 0 0.2"]))
    prop = scene.prop("rod")
    assert prop.barred.at("bend", 10.0) == pytest.approx(math.pi)
    height = [float(np.ptp(prop.shape(frame)[:, 1])) for frame in (0.0, 5.0, 10.0)]
    assert height[0] > height[1] > height[2]
    obstacle = SceneAnimation(scene).objects[prop.name].obstacle(4.0)
    assert isinstance(obstacle, Barr)
    np.testing.assert_allclose(obstacle.mesh(6.0)[0], prop.shape(10.0), atol=1e-12)


def test_animated_surfaces_are_objects(run, tmp_path: Path) -> None:
    from warpjld.grasp.shapes import ball

    thing = ball(0.05, subdivisions=2)
    grown = np.stack([thing.vertices, 2.0 * thing.vertices])
    np.savez(tmp_path / "bag.npz", vertices=grown, faces=thing.faces, frames=[10, 20])
    scene = run(f"OBJECT bag '{tmp_path / 'bag.npz'}' AT 0 1 0 SCALE 0.5")
    prop = scene.prop("bag")
    np.testing.assert_allclose(np.linalg.norm(prop.shape(15.0), axis=1), 0.5 * 1.5 * 0.025, atol=1e-6)
    obstacle = SceneAnimation(scene).objects[prop.name].obstacle(10.0)
    assert isinstance(obstacle, Keyframed)
    found = obstacle.project(np.array([[0.0, 1.1, 0.0]]), 10.0)
    assert found.distance[0] == pytest.approx(0.1 - 0.025, abs=1e-6)
    with pytest.raises(InputError, match="deformed by key frames or by formula"):
        run("PHYSICAL bag")
    for k, scale in enumerate((1.0, 1.1, 1.2)):
        rows = [f"v {x} {y} {z}" for x, y, z in scale * thing.vertices]
        rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in thing.faces]
        (tmp_path / f"sack.{k + 5:04d}.obj").write_text("\n".join(rows))
    from warpjld.grasp.keyframes import load_keyframes

    sack = load_keyframes(tmp_path / "sack.0005.obj")
    assert sack.frames.tolist() == [5, 6, 7]
    np.testing.assert_allclose(np.ptp(sack.at(7.0), axis=0), 1.2 * np.ptp(sack.at(5.0), axis=0), rtol=1e-5)


def test_built_in_shapes_are_exact_obstacles(run) -> None:
    scene = run(READY + "\nMOVE ball 0 0 0 0\nMOVE ball 10 1 0 0")
    ball, table = (SceneAnimation(scene).objects[name].obstacle(5.0) for name in ("BALL", "TABLE"))
    assert isinstance(ball, Sphere)
    assert isinstance(table, Box)
    assert ball.project(np.array([[1.1, 0.2, 0.3]]), 5.0).distance[0] == pytest.approx(-0.03)


def test_grips_hold_their_angles_until_something_is_found(run) -> None:
    scene = run(
        "SPLINE 1\nOBJECT ball BALL 0.05 AT 0.012 -0.06 -0.085\nPHYSICAL ball\nFLESH left\n"
        "GRASP 0 10 LEFT ball INDEX\nSTRENGTH LEFT INDEX 40\nSQUEEZE 10 14 LEFT FORCE 3 INDEX MOST 5\n"
        "LIFT 14 24 LEFT ball WEIGHT 0.5\nRELEASE 30 40 LEFT"
    )
    force, lift = scene.contact.grips
    assert (force.first, force.middle, force.last, force.force, force.digits) == (10, 14, 14, 3, ("index",))
    assert (lift.first, lift.middle, lift.last, lift.weight) == (14, 19, 24, 0.5)
    assert scene.contact.pull == (0.0, -9.81, 0.0)
    assert scene.contact.strength == {"LEFT": {"index": 40}}
    motion = scene.actor("left").motion
    for channel in force.channels:
        values = motion.value(channel, np.arange(10.0, 31.0))
        np.testing.assert_array_equal(values, values[0])
    actor = scene.actor("left")
    for channel in force.channels:
        joint = actor.skeleton.index(channel.rpartition(".")[0])
        value = float(motion.value(channel, 10.0)) + math.radians(2)
        write_keys(actor, AngleEdit("LEFT", joint, 10.0, None, value))
    base = motion.value("left.index.base.flexion", np.array([10.0, 14.0, 19.0, 24.0, 30.0, 40.0]))
    np.testing.assert_allclose(base[1:5] - base[0], math.radians(2), atol=1e-12)
    assert base[5] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("PHYSICAL bell", r"4:10: there is no object bell; did you mean BALL"),
        ("PHYSICAL ball YOUNG 0", r"4:21: Young's modulus in Pa must be greater than 0, got 0"),
        ("PHYSICAL ball POISSON 0.5", r"Poisson's ratio must be 0.4999 or less"),
        ("PHYSICAL ball HOLLOW 0.03", r"a wall must be thinner than half of BALL, 0.03 m"),
        ("PHYSICAL ball PRESSURE 1000", r"only a hollow object has an inside"),
        ("FLESH right", r"4:7: there is no actor right"),
        (
            "FLESH left TOE",
            r"expected an option \(ELEMENT/YOUNG/.*/ITSELF/FLEXION/BONES\), found TOE",
        ),
        ("FLESH left INDX", r"found INDX; did you mean INDEX"),
        ("FLESH left\nPRESS 0 4\nPRESS 2 4", r"6:1: line 5 asks for frames 0 to 4 already: one PRESS is enough"),
        ("FRICTION left ball nan", r"expected the coefficient of friction, found nan"),
        ("FRICTION left ball -1", r"must be 0 or more, got -1"),
        ("FRICTION left bal 1", r"there is no actor or object BAL; did you mean BALL"),
        ("BOND ball table 1e4", r"TABLE is not physical"),
        ("BOND ball ball 1e4", r"BALL cannot be bonded to itself"),
        ("VECTOR ball lid AT 0 0 0 0", r"BALL has no points LID; name them with POINTS BALL LID …"),
        ("POINTS table a ALL", r"TABLE is not physical"),
        ("DEFORM ball TWIST Y AT 0 30", r"BALL is physical: forces deform it, not formulas"),
        ("DEFORM table TAPER Y AT 0 1", r"a taper must be less than 1, got 1"),
        (
            "DEFORM table TWIST Y AT 0 30\nDEFORM table BEND X AT 0 30",
            "one axis an object",
        ),
        ("PRESS 10 10", r"the last frame must come after the first"),
        ("PRESS 0 10 AITKEN", r"it goes with METHOD PAPER"),
        ("SQUEEZE 0 10 LEFT 5", r"LEFT has grasped nothing"),
        ("SQUEEZE 0 10 LEFT FORCE 5", r"LEFT has grasped nothing"),
        ("LIFT 0 10 LEFT ball", r"LEFT has grasped nothing"),
        ("STRENGTH LEFT INDEX 0", r"the force in newtons must be greater than 0"),
        ("STRENGTH LEFT TOE 5", r"expected the digit \(THUMB/INDEX/MIDDLE/RING/PINKY\)"),
        ("PRESS 0 10 STOP CORRECT", r"STOP, CORRECT or RIGID, not two of them"),
        ("TACTILE 'touch.txt'", r"want a name that ends in \.csv, \.parquet, \.png"),
        ("PICTURE 0 'a.png' PRESSURE moon", r"there is no actor or object MOON"),
        ("PICTURE 0 'a.png' PRESSURE left INDX", r"expected a digit .*found INDX; did you mean INDEX"),
        (
            "PICTURE 0 'a.png' PRESSURE left INDEX",
            r"LEFT has no flesh whose digits can be shown",
        ),
    ],
)
def test_wrong_words_are_refused_with_their_place(run, line: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        run(f"{READY}\n{line}")


def test_pressing_wants_something_that_deforms(run) -> None:
    with pytest.raises(InputError, match=r"1:1: nothing deforms: make a body do so with FLESH or PHYSICAL first"):
        run("PRESS 0 10")
