"""From which equilibrium a trial of closings begins: the nearest from which digits need not open by much."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.grip.digit_squeeze import DigitSqueeze
from warpjld.simulation.grip.search_budget import SearchBudget
from warpjld.skeleton.channels import FLEXION

Array = NDArray[np.float64]
STEP = 0.01
"""Closing in a load step [rad]."""


class Bones:
    """Three joints, each a digit of its own; the last does not close."""

    bendable = True
    skeleton = SimpleNamespace(limits=np.tile([-1.0, 1.0], (3, FLEXION + 1, 1)))

    def angles(self, time: float) -> Array:
        return np.zeros((3, 4))

    def steps(self, ends: list[tuple[Array, float]], travel: float) -> int:
        return max(1, math.ceil(float(np.abs(ends[1][0] - ends[0][0]).max()) / STEP - 1e-9))

    def moves_of(self, angles: Array, time: float) -> Array:
        return angles[:2, FLEXION]


@pytest.fixture
def squeeze(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Two digits that close; ``taken`` gets the start and the load steps of every solve."""
    taken: list[tuple[list[float], int]] = []

    def solved(model: Any, history: Any, before: Any, steps: int, *, moves: Any, **_: Any) -> Any:
        taken.append((moves[1](0.0).round(9).tolist(), steps))
        return SimpleNamespace(converged=True, last=SimpleNamespace(time=0.0), spent=5 * steps)

    monkeypatch.setattr("warpjld.simulation.grip.digit_squeeze.solve_branch", solved)
    hand: Any = SimpleNamespace(name="LEFT", bones=Bones())
    first: Any = SimpleNamespace(last=SimpleNamespace(time=0.0), converged=True)
    out: Any = DigitSqueeze(None, History(), hand, {"a": [0], "b": [1]}, first, None, SearchBudget())  # type: ignore[arg-type]
    out.taken = taken
    return out


def test_a_trial_begins_where_the_last_ended_although_a_digit_opens_a_little(squeeze: Any) -> None:
    squeeze.solved_at(np.array([0.06, 0.06]))
    squeeze.solved_at(np.array([0.05, 0.09]))
    assert squeeze.taken == [([0.0, 0.0], 6), ([0.06, 0.06], 3)]


def test_digits_do_not_open_by_more_than_two_load_steps_in_all(squeeze: Any) -> None:
    """Three trials each open the first digit by one step: the last begins where it had never been closed so far."""
    for closing in (0.06, 0.05, 0.04, 0.03):
        squeeze.solved_at(np.array([closing, 0.06]))
    assert [start for start, _ in squeeze.taken] == [[0.0, 0.0], [0.06, 0.06], [0.05, 0.06], [0.0, 0.0]]


def test_it_begins_at_an_equal_closing_with_idle_digits_elsewhere(squeeze: Any) -> None:
    """It is not taken for the equilibrium itself: a digit that does not close was elsewhere."""
    angles = np.zeros((3, 4))
    angles[:, FLEXION] = 0.05
    known: Any = SimpleNamespace(converged=True, last=None)
    squeeze.note(np.array([0.05, 0.05]), angles, known)
    assert squeeze.known(np.array([0.05, 0.05])) is None
    squeeze.solved_at(np.array([0.05, 0.05]))
    assert squeeze.taken == [([0.05, 0.05], 1)]


def test_nothing_is_solved_once_the_linear_solves_are_spent(squeeze: Any) -> None:
    squeeze.solved_at(np.array([0.9, 0.9]))  # 450 linear solves
    assert squeeze.spent()
    assert squeeze.solved_at(np.array([0.91, 0.9])) is None
    assert len(squeeze.taken) == 1
