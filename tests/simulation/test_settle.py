"""What falls on uneven or soft things: it comes to rest, sinks in, and stays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from warpjld.fem.contact.obstacles.meshes import RigidMesh
from warpjld.grasp import Places
from warpjld.grasp.shapes import box
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.fall.rigid_body import RigidBody, rigid_shape
from warpjld.simulation.fall.time_stepping import step_bodies
from warpjld.simulation.simulate import Simulation
from warpjld.simulation.specification import ObjectMaterial

STEP = 1.0 / 240.0


def rough_ground(seed: int) -> RigidMesh:
    """A closed slab whose upper side has peaks up to a millimetre high every 7 mm, highest in the middle."""
    count = 12, 9
    x, z = np.meshgrid(np.linspace(-0.04, 0.04, count[0]), np.linspace(-0.03, 0.03, count[1]), indexing="ij")
    height = np.random.default_rng(seed).uniform(-1e-3, 0.0, count) - 2.0 * (x**2 + z**2)
    top = np.stack([x, height, z], axis=-1).reshape(-1, 3)
    number = np.arange(len(top)).reshape(count)
    a, b, c, d = (one.ravel() for one in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    up = np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, c, b], axis=1)])
    rim = np.concatenate([number[:, 0], number[-1, 1:], number[-2::-1, -1], number[0, -2:0:-1]])
    ahead, below = np.roll(rim, -1), len(top)
    side = [np.stack([rim, ahead, ahead + below], axis=1), np.stack([rim, ahead + below, rim + below], axis=1)]
    points = np.concatenate([top, top * [1.0, 0.0, 1.0] - [0.0, 0.02, 0.0]])
    mesh = trimesh.Trimesh(points, np.concatenate([up, up[:, ::-1] + below, *side]))
    mesh.fix_normals()
    assert mesh.is_watertight
    return RigidMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def test_a_plate_rests_on_peaks_below_its_middle() -> None:
    """It was borne by the outermost near points and the deepest one only, rocked for ever at a tenth of a metre a
    second, and fell through peaks by a tenth of a millimetre."""
    plate = RigidBody(
        rigid_shape("plate", box(0.06, 0.004, 0.04), ObjectMaterial(density=300.0)),
        Places.of((0.001, 0.0021, 0.002), (0.0, 0.0, 0.0, 1.0)),
    )
    ground, gravity = {"ground": rough_ground(1)}, np.array([0.0, -9.81, 0.0])
    for k in range(24):
        step_bodies([plate], ground, gravity, lambda a, b: 0.6, time=float(k), step=1.0, length=STEP)
    assert plate.touching == ("ground",)
    assert plate.speed < 1e-4
    depth = -plate.project(ground["ground"].mesh(0.0)[0]).distance
    assert depth.max() < 1e-5


def run(text: str, folder: Path) -> Simulation:
    scene = Scene(say=lambda _: None)
    Interpreter(scene).run_text(text)
    return run_contact(scene, folder)


@pytest.mark.slow
def test_a_light_plate_that_is_let_go_stays_on_three_fingers(tmp_path: Path) -> None:
    # gravity points to the back of the hand
    found = run(
        "HAND LEFT BUILTIN\nRATE 30\nGRAVITY 0 9.81 0\nFRAMES 0 20\n"
        "OBJECT PLATE BOX 0.06 0.004 0.04 AT 0.01 -0.030 -0.150\n"
        "PHYSICAL PLATE YOUNG 1e6 POISSON 0.3 DENSITY 300 ELEMENT 0.01\nPOINTS PLATE WHOLE ALL\nHOLD PLATE WHOLE 3\n"
        "FLESH LEFT INDEX MIDDLE RING ELEMENT 0.005\nFRICTION LEFT PLATE 0.6\nPRESS 0 20 EVERY 10\n",
        tmp_path,
    )
    weight = 300.0 * 0.06 * 0.004 * 0.04 * 9.81
    assert found.verdict.status == "RELEASED"
    assert not found.verdict.failed
    assert "comes to rest on LEFT" in found.verdict.text
    assert found.frames[-1] == 20.0
    for force in found.force("PLATE")[-2:]:
        assert force == pytest.approx([0.0, -weight, 0.0], rel=5e-3, abs=5e-3 * weight)
    before, after = (found.surfaces.object("PLATE", frame) for frame in (10.0, 20.0))
    assert before is not None
    assert after is not None
    assert np.abs(after - before).max() < 1e-5


CURL = "\n".join(
    f"FINGER1 LEFT {digit} FLEXION AT {frame} {flexion}\nFINGER23 LEFT {digit} KNUCKLES2 AT {frame} {knuckles}"
    for digit in ("INDEX", "MIDDLE", "RING", "PINKY")
    for frame, flexion, knuckles in ((0, 20, 30), (70, 20, 30), (80, 40, 50))
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "gravity", "place"),
    [("", (0.0, 9.81, 0.0), "0.004 -0.062 -0.085"), ("hand_webxr_generic", (-9.81, 0.0, 0.0), "0.029 -0.033 0.006")],
)
def test_a_ball_that_falls_into_an_open_hand_lies_in_it_while_the_hand_closes(
    file: str, gravity: tuple[float, float, float], place: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    hand = f'"{request.getfixturevalue("data") / file / "left.glb"}"' if file else "BUILTIN"
    found = run(
        f"HAND LEFT {hand}\nRATE 30\nSPLINE 1\nGRAVITY {' '.join(map(str, gravity))}\nFRAMES 0 80\n{CURL}\n"
        f"OBJECT BALL BALL 0.05 AT {place}\nPHYSICAL BALL YOUNG 1e5 POISSON 0.4 ELEMENT 0.008\n"
        "FLESH LEFT INDEX MIDDLE RING PINKY PALM ELEMENT 0.006\nFRICTION LEFT BALL 0.6\nPRESS 0 80 EVERY 5\n",
        tmp_path,
    )
    assert found.verdict.status == "CONVERGED"
    assert found.verdict.text.startswith("realistic")
    assert "comes to rest on LEFT" in found.verdict.text
    assert any(line.startswith("on BALL") and line.endswith("bear its weight") for line in found.verdict.balance)
    # faceted, the ball weighs a few percent less
    weight, forces = 1000.0 * np.pi / 6.0 * 0.05**3 * 9.81, found.force("BALL")
    assert np.linalg.norm(forces[-1]) == pytest.approx(weight, rel=0.08)
    assert forces[-1] @ gravity == pytest.approx(-9.81 * np.linalg.norm(forces[-1]), rel=1e-3)
