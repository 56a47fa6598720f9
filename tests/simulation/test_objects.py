"""Objects without a hand: prescribed points, bonds that let go, obstacles that move and deform."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.fem import SolveStatus
from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.script.props import prop_places
from warpjld.simulation.simulate import Simulation

BLOCK = """
OBJECT block BOX 0.02 0.02 0.02
PHYSICAL block LAW LINEAR YOUNG 1e5 POISSON 0.3 ELEMENT 0.005
POINTS block foot LOWER Y 0
POINTS block head UPPER Y 0
HOLD block foot
FRICTION 0
"""


@pytest.fixture
def run() -> Callable[[str], Scene]:
    """Runs lines on a stage of objects alone: a hand there would be an obstacle."""

    def run_text(text: str) -> Scene:
        scene = Scene(say=lambda text: None)
        Interpreter(scene).run_text(text)
        return scene

    return run_text


def heights(report: Simulation, name: str) -> list[float]:
    """Extent along y of an object at every frame that was solved [m]."""
    frames = report.solved.frames
    return [float(np.ptp(report.surfaces.object(name, frame.frame)[:, 1])) for frame in frames]


def test_points_are_drawn_along_keys(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(BLOCK + "VECTOR block head AT 0 0 0 0\nVECTOR block head AT 4 0 0.002 0\nPRESS 0 4")
    report = run_contact(scene, tmp_path)
    assert report.solved.status is SolveStatus.CONVERGED
    np.testing.assert_allclose(heights(report, "BLOCK"), 0.02 + 0.0005 * np.arange(1, 5), atol=1e-9)
    pull = [float(np.abs(f.reactions[:, 1]).sum()) / 2 for f in report.solved.frames]
    np.testing.assert_allclose(np.diff(pull), pull[0], rtol=1e-3)
    # E A ε, a little more as head and foot cannot narrow
    assert 1.0 < pull[-1] / (1e5 * 0.02**2 * 0.1) < 1.2


def test_partial_points_stay_free_along_the_others(run: Callable[[str], Scene], tmp_path: Path) -> None:
    lines = BLOCK.replace("HOLD block foot\n", "PARTIAL block foot Y AT 0 0\n")
    scene = run(lines + "PARTIAL block head Y AT 0 0\nPARTIAL block head Y AT 2 -0.002\nPRESS 0 2")
    # along y only: nothing pushes it sideways, and a corner is enough to hold it there
    report = run_contact(scene, tmp_path)
    assert report.solved.status is SolveStatus.CONVERGED
    shape = report.surfaces.object("BLOCK", 2.0)
    np.testing.assert_allclose(np.ptp(shape, axis=0), [0.02 * 1.03, 0.018, 0.02 * 1.03], rtol=2e-3)
    assert np.abs(shape[:, [0, 2]].mean(axis=0)).max() < 4e-4


def test_held_points_go_where_the_object_goes(run: Callable[[str], Scene], tmp_path: Path) -> None:
    moved = "MOVE block 0 0 0 0\nMOVE block 2 0.1 0 0\nTURN block 0 0 0 0\nTURN block 2 0 90 0\n"
    scene = run(f"{BLOCK}{moved}GRAVITY 0 -9.81 0\nPRESS 0 2")
    scene.contact.physical["BLOCK"] = type(scene.contact.physical["BLOCK"])(young=1e5, poisson=0.3, element=0.005)
    report = run_contact(scene, tmp_path)
    assert report.solved.status is SolveStatus.CONVERGED
    place = prop_places(scene.actors, scene.rate, scene.prop("block"), np.array([2.0]))
    np.testing.assert_allclose(
        report.surfaces.object("BLOCK", 2.0), place.apply(scene.prop("block").thing.vertices)[0], atol=4e-5
    )


def test_a_bond_holds_until_it_is_pulled_too_hard(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(
        BLOCK
        + "OBJECT lid BOX 0.02 0.02 0.02 AT 0 0.02 0\nPHYSICAL lid LAW LINEAR YOUNG 1e5 POISSON 0.3 ELEMENT 0.005\n"
        "POINTS lid top UPPER Y 0\nVECTOR lid top AT 0 0 0 0\nVECTOR lid top AT 4 0 0.002 0\n"
        "BOND block lid 3000\nPRESS 0 4"
    )
    report = run_contact(scene, tmp_path)
    assert report.solved.status is SolveStatus.CONVERGED
    grown = [h - 0.02 for h in heights(report, "BLOCK")]
    assert grown[0] > 1e-4  # pulled along: 0.5 mm over both
    assert grown[-1] < 1e-6  # let go
    gap = report.surfaces.object("LID", 4.0)[:, 1].min() - report.surfaces.object("BLOCK", 4.0)[:, 1].max()
    assert gap == pytest.approx(0.002, abs=1e-5)


@pytest.mark.parametrize(
    ("place", "way"), [("0.3 0.035 0", "0 -0.090 0"), ("0.265 0.006 0", "0.090 0 0")], ids=["down", "sideways"]
)
def test_objects_that_would_pass_in_two_frames_are_named(
    run: Callable[[str], Scene], tmp_path: Path, place: str, way: str
) -> None:
    """.045 m a frame, apart at both ends: their middles would have to change places. The hand is elsewhere."""
    flesh = "LAW LINEAR YOUNG 1e5 POISSON 0.3 ELEMENT 0.01"
    scene = run(
        f"OBJECT one BOX 0.02 0.02 0.02 AT 0.3 0 0\nPHYSICAL one {flesh}\nPOINTS one foot LOWER Y 0.1\nHOLD one foot\n"
        f"OBJECT two BOX 0.02 0.02 0.02 AT {place}\nPHYSICAL two {flesh}\nPOINTS two top UPPER Y 0.1\nHOLD two top\n"
        f"MOVE two 0 0 0 0\nMOVE two 2 {way}\nSPLINE 1\nPRESS 0 2"
    )
    report = run_contact(scene, tmp_path)
    assert report.solved.status in (SolveStatus.PASSED, SolveStatus.BLOCKED)  # what is held lies 10 mm inside, too
    assert "ONE–TWO" in report.verdict.text


@pytest.mark.parametrize(
    "obstacle",
    [
        "OBJECT lid BOX 0.04 0.01 0.04 AT 0 0.0152 0\nMOVE lid 0 0 0 0\nMOVE lid 2 0 -0.0012 0",
        "OBJECT lid BALL 0.03 AT 0 0.0252 0\nMOVE lid 0 0 0 0\nMOVE lid 2 0 -0.0012 0",
        # a rod that bends: its end comes down on the block
        "OBJECT lid BOX 0.10 0.01 0.02 AT 0.045 0.0152 0\nDEFORM lid BEND X AT 0 0\nDEFORM lid BEND X AT 2 -6",
    ],
    ids=["plate", "ball", "bent rod"],
)
def test_obstacles_press(run: Callable[[str], Scene], tmp_path: Path, obstacle: str) -> None:
    scene = run(f"{BLOCK}{obstacle}\nPRESS 0 2")
    report = run_contact(scene, tmp_path)
    assert report.solved.status is SolveStatus.CONVERGED
    last = report.solved.frames[-1]
    assert last.nodal.sum(axis=(0, 1))[1] < -1e-3
    assert report.surfaces.pressure("BLOCK", 2.0).max() > 100.0
    assert last.penetration < 1e-5
