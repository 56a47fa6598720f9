"""A hand that does not press or hold as asked: the verdict and the command say so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from warpjld.errors import InputError
from warpjld.fem import SolveStatus
from warpjld.script import Scene
from warpjld.script.runner import run_scene
from warpjld.simulation.grip.found import FoundGrip
from warpjld.simulation.report.verdict import verdict_of
from warpjld.simulation.solve_result import SolveResult
from warpjld.simulation.specification import GripSpecification

PRESS = GripSpecification("LEFT", "CAN", 24.0, 30.0, ("left.thumb.proximal.flexion",), most=0.3, force=4.0)


def grip(status: str, force: float) -> FoundGrip:
    digits = {"left.thumb": (0.2, 60.0, 0.01), "left.index": (force - 0.2, 40.0, 0.01)}
    return FoundGrip(PRESS, status, "all of it", 0.1, None, force, digits)


def judged(one: FoundGrip) -> tuple[str, str, bool]:
    solved = SolveResult(SolveStatus.CONVERGED, "", None, grips=(one,))  # type: ignore[arg-type]
    found = verdict_of(solved, [], [])
    return found.status, found.text, found.failed


def test_a_force_that_is_not_reached_is_the_verdict() -> None:
    status, text, failed = judged(grip("UNOPPOSED", 0.6))
    assert status == "SHORT"
    assert failed
    assert text.startswith("not as asked: LEFT at frame 24: 0.6 of 4 N (thumb 0.2 N, index 0.4 N): ")
    assert "nothing opposes more" in text


@pytest.mark.parametrize("status", ["REACHED", "UNEVEN"])
def test_a_force_that_is_reached_is_not(status: str) -> None:
    assert judged(grip(status, 4.0)) == ("CONVERGED", "solved", False)


@pytest.mark.slow
def test_the_command_fails_and_keeps_its_files(run: Callable[[str], Scene], tmp_path: Path) -> None:
    """A thumb that touches nothing cannot press with 1 N."""
    scene = run(
        "FRAMES 0 2\nOBJECT BALL BALL 0.02 AT 1 0 0\nGRASP 0 1 LEFT BALL THUMB\n"
        'SQUEEZE 1 2 LEFT FORCE 1 THUMB MOST 2\nFLESH LEFT THUMB ELEMENT 0.006\nPRESS 0 2\nTABLE "contact.csv"\n'
    )
    with pytest.raises(InputError, match=r"not as asked: LEFT at frame 1: 0 of 1 N: nothing is touched"):
        run_scene(scene, tmp_path)
    assert (tmp_path / "contact.csv").is_file()
