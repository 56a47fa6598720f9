"""What surfaces show that no force knows of is said, with digits and frames."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from warpjld.fem import SolveStatus
from warpjld.script import Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.display.overlap import Overlap, SurfacePart
from warpjld.simulation.report.verdict import verdict_of
from warpjld.simulation.report.visible_overlap import remaining_overlaps
from warpjld.simulation.solve_result import SolveResult

A, B = SurfacePart("A"), SurfacePart("B")


def deep(depth: float) -> Overlap:
    return Overlap(np.array([3]), np.array([[0.0, depth, 0.0]]))


def test_overlap_that_contact_left_is_a_status_of_its_own() -> None:
    """Two objects that are 4 mm in one another at frames 2 and 3, and 0.5 mm at frame 1, with elements of 4 mm."""
    depths = {1.0: 5e-4, 2.0: 4e-3, 3.0: 3e-3}
    pressed = SimpleNamespace(
        model=SimpleNamespace(hands=()),
        frames=[SimpleNamespace(frame=frame) for frame in depths],
        overlaps=lambda frame, deeper: {(A, B): deep(depths[frame]), (B, A): deep(1e-4)},
        most=lambda name: 2e-3,
    )
    (found,) = remaining_overlaps(pressed)  # type: ignore[arg-type]
    assert found.text == "A and B overlap by 4.0 mm at frames 2 to 3"
    solved = SolveResult(SolveStatus.CONVERGED, "", None)  # type: ignore[arg-type]
    verdict = verdict_of(solved, [], [], [found])
    assert verdict.status == "OVERLAP"
    assert verdict.text == "not solved: A and B overlap by 4.0 mm at frames 2 to 3, and forces there are wrong"
    assert verdict_of(solved, [], []).status == "CONVERGED"


def test_digits_that_meet_skin_without_flesh_are_named(run: Callable[[str], Scene], tmp_path: Path) -> None:
    """A thumb and an index finger pinch, and the finger has no flesh: contact knows nothing of it, and says so."""
    scene = run(
        "FRAMES 0 1\nFINGER1 LEFT INDEX FLEXION AT 0 42.9\nFINGER23 LEFT INDEX KNUCKLES2 AT 0 56.3\n"
        "FINGER23 LEFT INDEX KNUCKLES3 AT 0 32.3\nFINGER1 LEFT THUMB FLEXION AT 0 15\n"
        "FINGER1 LEFT THUMB PIVOT AT 0 6.2\nFINGER23 LEFT THUMB KNUCKLES2 AT 0 32.1\n"
        "FINGER23 LEFT THUMB KNUCKLES3 AT 0 26.1\nFLESH LEFT THUMB ELEMENT 0.004\n"
        "OBJECT far BALL 0.02 AT 1 0 0\nPRESS 0 1\n"
    )
    report = run_contact(scene, tmp_path)
    assert report.verdict.status == "CONVERGED"
    (note,) = (note for note in report.notes if "overlap" in note)
    assert note.startswith("LEFT index and LEFT thumb are seen to overlap by ")
    assert note.endswith("at frame 1: FLESH LEFT … INDEX makes them press on each other")
