"""Nothing is stepped over: steps are cut where skin goes past things, and touches between frames are said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from warpjld.errors import InputError
from warpjld.fem.contact.obstacles.solids import Box, Plane, Sphere
from warpjld.fem.contact.obstacles.thickness import distance_past, half_thickness
from warpjld.script import Scene
from warpjld.script.contact import run_contact

PLATE = (
    "OBJECT plate BOX 0.036 0.002 0.036 AT 0.034 -0.0275 -0.165\nSPLINE 1\nFLESH LEFT INDEX ELEMENT 0.004\nRATE 10\n"
)


@pytest.mark.parametrize(
    ("obstacle", "half"),
    [
        (Sphere((0, 0, 0), 0.006), 0.006),
        (Box((0.05, 0.003, 0.05), (0, 0, 0), 0.0005), 0.0015),
    ],
)
def test_how_thick_obstacles_are(obstacle, half: float) -> None:  # type: ignore[no-untyped-def]
    found = half_thickness(obstacle)
    assert 0.6 * half < found <= half * (1.0 + 1e-6)


def test_a_plane_is_thicker_than_anything_goes() -> None:
    assert half_thickness(Plane((0, 0, 0), (0, 0, 1))) > 0.1


def test_ways_past_what_moves_along_count_for_nothing() -> None:
    x = np.array([[0.0, 0.0, 0.004], [0.0, 0.0, 0.5]])
    down = np.array([0.0, 0.0, -0.01])
    gone = [x, x + 0.5 * down, x + down]
    times = [0.0, 0.5, 1.0]
    still = Sphere((0, 0, 0), 0.003)
    assert distance_past(still, times, gone) == pytest.approx(0.01)
    assert distance_past(still, times, [x, x, x]) == 0.0
    along = Sphere((0, 0, 0), 0.003, motion=lambda t: ((0.0, 0.0, -0.01 * t), (0, 0, 0, 1)))
    assert distance_past(along, times, gone) == 0.0
    towards = Sphere((0, 0, 0), 0.003, motion=lambda t: ((0.0, 0.0, 0.01 * t), (0, 0, 0, 1)))
    assert distance_past(towards, times, [x, x, x]) == pytest.approx(0.01)


def test_a_finger_does_not_jump_through_a_plate(run: Callable[[str], Scene], tmp_path: Path) -> None:
    """At frame 1 it is above the plate, at frame 2 below: the bone cannot have got there."""
    scene = run(
        PLATE + "MOVE LEFT 0 0 0.006 0\nMOVE LEFT 1 0 0.006 0\nMOVE LEFT 2 0 -0.030 0\nMOVE LEFT 3 0 -0.031 0\n"
        "FRAMES 0 3\nPRESS 0 3\n"
    )
    report = run_contact(scene, tmp_path)
    assert report.solved.start == 1.0
    assert report.verdict.status != "CONVERGED"
    assert "the bone of LEFT index is" in report.verdict.text
    assert "inside PLATE" in report.verdict.text


def test_a_tap_between_two_frames_is_said(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(
        PLATE + "MOVE LEFT 0 0 0.002 0\nMOVE LEFT 1 0 -0.0065 0\nMOVE LEFT 2 0 0.002 0\nMOVE LEFT 4 0 0.002 0\n"
        "FRAMES 0 4\nPRESS 0 4 EVERY 2\n"
    )
    report = run_contact(scene, tmp_path)
    assert report.verdict.status == "CONVERGED"
    assert all(row.force_n < 1e-6 for row in report.rows)
    (brush,) = report.solved.missed
    assert (brush.actor, brush.digit, brush.against, brush.before, brush.after) == ("LEFT", "index", "PLATE", 0.0, 2.0)
    assert brush.force > 0.01
    assert report.verdict.text.startswith("nothing touches at any frame, but between them: LEFT index touches PLATE")
    assert brush.text in report.notes


def test_skin_that_begins_too_deep_is_refused(run: Callable[[str], Scene], tmp_path: Path) -> None:
    scene = run(
        "OBJECT ball BALL 0.05 AT 0.034 -0.027 -0.165\nPHYSICAL BALL YOUNG 100000 ELEMENT 0.006\n"
        "POINTS BALL FOOT LOWER Y 0.1\nHOLD BALL FOOT\nFLESH LEFT INDEX ELEMENT 0.004\nFRAMES 0 2\nPRESS 0 2\n"
    )
    with pytest.raises(InputError, match=r"LEFT index: 1\d mm inside BALL at frame 0, where contact begins"):
        run_contact(scene, tmp_path)
