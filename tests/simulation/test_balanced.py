"""A requested force, distributed over digits such that they oppose one another on a rigid object."""

from __future__ import annotations

import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.script import Interpreter, Scene
from warpjld.script.contact import run_contact
from warpjld.simulation.grip import balanced as module
from warpjld.simulation.grip.balanced import opposed_scales
from warpjld.simulation.report.balance import balances
from warpjld.simulation.solve_result import SolveResult

Array = NDArray[np.float64]


def wrenches(forces: Array, at: Array) -> Array:
    """Forces (D, 3) at points (D, 3), with their moments, shape (D, 6)."""
    return np.concatenate([forces, np.cross(at, forces)], axis=1)


def scaled(forces: Array, at: Array, rest: Array, total: float) -> tuple[Array, Array]:
    """Factors on forces, and what is left over with them, shape (6,)."""
    each = wrenches(forces, at)
    scales = opposed_scales(each, rest, np.linalg.norm(forces, axis=1), total)
    return scales, scales @ each + rest


@pytest.mark.parametrize("total", [0.5, 4.0, 40.0])
def test_a_thumb_presses_as_much_as_two_fingers(total: float) -> None:
    forces = np.array([[1.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    at = np.array([[-1.0, 0.0, 0.0], [1.0, 0.5, 0.0], [1.0, -0.5, 0.0]])
    scales, left = scaled(forces, at, np.zeros(6), total)
    sizes = scales * np.linalg.norm(forces, axis=1)
    assert sizes.sum() == pytest.approx(total, rel=1e-9)
    np.testing.assert_allclose(sizes / total, [0.5, 0.25, 0.25], atol=0.01)
    assert np.abs(left).max() < 0.02 * total


def test_what_others_press_with_counts() -> None:
    """A palm bears 1 N of what a finger presses with: the thumb does not have to."""
    forces, at = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    scales, left = scaled(forces, at, np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), 4.0)
    np.testing.assert_allclose(scales, [1.5, 2.5], atol=0.02)
    assert np.abs(left).max() < 0.05


def test_one_direction_cannot_be_balanced() -> None:
    """Nothing opposes two fingers on the same side: each keeps its part, and all is left over."""
    forces, at = np.tile([0.0, -1.0, 0.0], (2, 1)), np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    scales, left = scaled(forces, at, np.zeros(6), 4.0)
    np.testing.assert_allclose(scales, 2.0, atol=1e-6)
    assert left[1] == pytest.approx(-4.0)


@pytest.mark.parametrize(
    ("found", "best"),
    [
        ([(3.9, 0.1), (4.0, 0.3), (3.95, 0.2), (4.09, 0.0)], 3.95),  # of those with 4 N the best balanced one
        ([(2.0, 0.1), (3.5, 0.9), (3.8, 1.1)], 3.5),  # else the firmest that is balanced
        ([(3.9, 1.2), (4.5, 0.2)], None),
    ],
)
def test_which_of_the_grips_found_is_taken(
    found: list[tuple[float, float]], best: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Grips with the force of one digit [N], and what is left over of 1 N that may be."""
    monkeypatch.setattr(module, "worst_opposed", lambda _, left, name: SimpleNamespace(net=left))
    monkeypatch.setattr(module, "allowed_left", lambda balance: 1.0)
    digits = {force: SimpleNamespace(force=force, share=0.1) for force, _ in found}

    class Pressed(SimpleNamespace):
        def __getitem__(self, name: str) -> SimpleNamespace:
            return self.digits[0]  # type: ignore[no-any-return]

    each: Any = SimpleNamespace(
        found=[(np.array([force]), left) for force, left in found],
        effort=lambda grips, left: Pressed(digits=[digits[grips[0]]]),
        angles=lambda grips: np.zeros((1, 4)),
        model=None,
        digits=("thumb",),
        joints=[[0]],
    )
    taken = module._firmest(each, SimpleNamespace(object="BOX"), 4.0)  # type: ignore[arg-type]
    assert (None if taken is None else taken.forces.sum()) == best


def squeezed(flesh: str) -> SolveResult:
    """A box squeezed with 4 N by a hand of which these digits have flesh; by default all."""
    scene = Scene(say=lambda line: None)
    Interpreter(scene).run_text(
        "HAND LEFT BUILTIN\nOBJECT BOX BOX 0.05 0.08 0.05 AT 0 0 0\nFRAMES 0 30\nSPLINE 1\n"
        f"GRASP 0 24 LEFT BOX AUTO TRIES 8\nSQUEEZE 24 30 LEFT FORCE 4\nFLESH LEFT {flesh} ELEMENT 0.006\n"
        "PRESS 20 30 EVERY 2"
    )
    with tempfile.TemporaryDirectory() as folder:
        return run_contact(scene, Path(folder)).solved


@pytest.mark.slow
def test_a_force_that_is_asked_for_is_balanced() -> None:
    """Closing all joints alike leaves half of the forces on a fixed box unopposed."""
    found = squeezed("")
    grip = found.grips[0]
    assert grip.status == "REACHED"
    assert "closed digit by digit, to balance BOX" in grip.text
    assert grip.force == pytest.approx(4.0, rel=0.02)
    box = next(one for one in balances(found.model, found.frames[-1]) if one.object == "BOX")
    assert box.pressing == pytest.approx(4.0, rel=0.06)
    assert not box.unbalanced
    assert box.net < 0.25 * box.pressing


@pytest.mark.slow
def test_a_force_that_nothing_opposes_is_not_reached() -> None:
    """Two fingers press a box against a thumb without flesh, which touches nothing: at most as hard as it is heavy."""
    found = squeezed("INDEX MIDDLE")
    grip = found.grips[0]
    assert grip.status == "UNOPPOSED"
    assert "nothing opposes more" in grip.text
    assert 1.0 < grip.force < 3.0
    box = next(one for one in balances(found.model, found.frames[-1]) if one.object == "BOX")
    assert box.net <= 1.1 * box.weight  # the last frame is solved anew
    assert [row["chosen"] for row in grip.rows].count(1) == 1
