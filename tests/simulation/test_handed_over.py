"""When frames go on with the equilibrium that a search for a grip found."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from warpjld.fem import Prescribed
from warpjld.simulation.bodies.deformable_body import History
from warpjld.simulation.solve.handed_over import HandedOver

POSE = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [0.0, 0.0, 0.0]])
"""Displacements of two nodes of a hand and one of an object [m]."""


def model_at(displacement: np.ndarray) -> Any:
    """A model that prescribes them, whenever it is asked."""
    known = Prescribed(np.arange(9), displacement.reshape(-1))
    return SimpleNamespace(prescribed=lambda time, history: known, spans={"LEFT": slice(0, 2)})


@pytest.mark.parametrize(
    ("since", "time", "goes_on"), [(5.0, 7.0, True), (6.0, 8.0, True), (3.0, 5.0, False), (7.0, 9.0, False)]
)
def test_it_is_the_frame_from_which_on_the_hand_alone_holds(since: float, time: float, goes_on: bool) -> None:
    start = HandedOver("LEFT", 7.0, POSE, ()).start(model_at(POSE), History(), since, time)
    assert (start is not None) == goes_on
    if start is not None:
        assert start.last.time == since
        np.testing.assert_array_equal(start.last.displacement, POSE)
        assert start.correction_rate is None  # a rate per unit of the search's time


def test_a_hand_that_other_keys_moved_does_not_go_on_with_it() -> None:
    moved, pushed = POSE.copy(), POSE.copy()
    moved[1, 0] += 1e-3
    pushed[2, 0] += 1e-3
    over = HandedOver("LEFT", 7.0, POSE, ())
    assert over.start(model_at(moved), History(), 5.0, 7.0) is None
    assert over.start(model_at(pushed), History(), 5.0, 7.0) is not None  # bodies beside it are solved for
