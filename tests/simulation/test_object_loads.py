"""Forces, tractions, pressures, turning and stresses that scripts ask for: bars whose answers are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.materials import MATERIALS, pair_friction
from warpjld.simulation.simulate import Simulation

SIDE, LENGTH, YOUNG = 0.01, 0.04, 1e6
BAR = (
    f"OBJECT BAR BOX {SIDE} {LENGTH} {SIDE}\n"
    f"PHYSICAL BAR LAW LINEAR YOUNG {YOUNG:g} POISSON 0 ELEMENT 0.005\n"
    "POINTS BAR FOOT LOWER Y 0\nPOINTS BAR TOP UPPER Y 0\nPOINTS BAR BODY ALL\nHOLD BAR FOOT\nFRAMES 0 2\nPRESS 0 2\n"
)
AREA = SIDE**2


def run(text: str) -> Simulation:
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(text)
    return run_contact(scene, Path())


def stretch(found: Simulation, frame: int = -1) -> float:
    """How far the bar's top has risen [m]."""
    y = found.model.body.mesh.nodes[:, 1]
    return float(found.displacement[frame][y > y.max() - 1e-9, 1].mean())


@pytest.mark.parametrize(
    ("load", "within"),
    [
        ("FORCE BAR TOP 0 2 2 0 0.5 0", 0.05),  # shared evenly by the points, not by their areas: the end bends
        ("TRACTION BAR TOP 0 2 2 0 5000 0", 1e-3),
        ("PRESSURE BAR TOP AT 0 -5000", 1e-3),
    ],
)
def test_a_bar_is_pulled_by_its_end(load: str, within: float) -> None:
    found = run(BAR + load + "\n")
    assert found.verdict.status == "CONVERGED"
    assert stretch(found) == pytest.approx(0.5 * LENGTH / (YOUNG * AREA), rel=within)


def test_loads_follow_their_keys() -> None:
    found = run(BAR + "FORCE BAR FOOT AT 0 0 1 0\nSPLINE 0 0 0\nFORCE BAR TOP AT 0 0 0 0\nFORCE BAR TOP AT 2 0 1 0\n")
    assert stretch(found, 0) == pytest.approx(0.5 * stretch(found, 1), rel=1e-3)
    # a force on what is held does nothing, which is told
    assert [note for note in found.notes if "force" in note] == [
        "BAR: the force on points FOOT deforms nothing: they are all held"
    ]


def test_a_bar_that_turns_is_pulled_by_its_own_weight() -> None:
    turns = 5.0
    found = run(BAR + f"SPIN BAR X AT 0 {turns} AT 0 {-0.5 * LENGTH} 0\n")
    speed = 2.0 * np.pi * turns
    # about its foot: u(L) = ρ ω² L³ / 3 E
    assert stretch(found) == pytest.approx(1000.0 * speed**2 * LENGTH**3 / (3.0 * YOUNG), rel=0.02)


def test_a_stress_at_rest_relaxes() -> None:
    found = run(BAR + "PRESTRESS BAR 0 5000 0\n")
    assert found.frames.tolist() == [1.0, 2.0]  # it acts from the first frame on, as loads do
    assert stretch(found) == pytest.approx(-5000.0 / YOUNG * LENGTH, rel=1e-3)


def test_only_the_object_itself_is_loaded() -> None:
    other = (
        "OBJECT BAR2 BOX 0.01 0.04 0.01 AT 0.1 0 0\nPHYSICAL BAR2 ELEMENT 0.005\nPOINTS BAR2 ALL2 ALL\nHOLD BAR2 ALL2\n"
    )
    found = run(BAR + other + "SPIN BAR X AT 0 5 AT 0 -0.02 0\nFORCE BAR TOP AT 0 0 0.5 0\n")
    assert found.displacement[-1][found.model.spans["BAR2"]] == pytest.approx(0.0, abs=1e-12)
    assert stretch(found) != 0.0


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("FORCE BAR NECK AT 0 0 1 0", "BAR has no points NECK"),
        ("FORCE BAR TOP AT 0 0 1", "force along z"),
        ("SPIN BAR W AT 0 1", "the axis"),
        ("PRESTRESS BAR 1 2", "the stress zz in Pa"),
        ("OBJECT BOX2 BOX 0.1 0.1 0.1\nPRESSURE BOX2 TOP AT 0 1", "BOX2 is not physical"),
        ("PHYSICAL BAR OF ADAMANT", "a material"),
        ("POINTS BAR FOOT UPPER Y 0", "points FOOT of BAR are used above already"),
    ],
)
def test_wrong_lines_are_named(line: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        run(BAR + line + "\n")


def test_faces_want_enough_points() -> None:
    with pytest.raises(InputError, match="no face of the surface lies between them"):
        run(BAR + "POINTS BAR TIP NEAR 0.005 0.02 0.005 0.001\nPRESSURE BAR TIP AT 0 1\n")


def test_named_materials() -> None:
    scene = Scene(say=lambda text: None)
    Interpreter(scene).run_text(
        "OBJECT A BALL 0.02\nOBJECT B BALL 0.02 AT 0.1 0 0\nPHYSICAL A OF STEEL\nPHYSICAL B OF ALUMINIUM DENSITY 2600\n"
    )
    one, other = scene.contact.physical["A"], scene.contact.physical["B"]
    assert (one.young, one.density) == (MATERIALS["steel"].young, MATERIALS["steel"].density)
    assert other.density == 2600.0
    assert scene.contact.coefficient("A", "B") == pair_friction("aluminium", "steel") == 0.61
    assert scene.contact.coefficient("A", "C") == 0.6  # not known: as for skin
    assert all(one.material() is not None for one in scene.contact.physical.values())
    assert all(matter.source for matter in MATERIALS.values())
