"""The support of an object that a hand lifts, over time."""

from __future__ import annotations

import numpy as np
import pytest

from warpjld.simulation.bodies.support import ObjectSupport


def test_a_support_that_is_not_released_stands_for_ever() -> None:
    support = ObjectSupport(1)
    assert support.stands(1e6)
    assert support.resistance(1e6) == support.borne(1e6) == 0.0


def test_weight_and_medium_go_while_the_hand_takes_the_object() -> None:
    support = ObjectSupport(1).released(2.0, 6.0, 10.0, 3.0)
    assert support.stands(2.0)
    times = np.array([2.5, 6.0, 6.5, 7.0, 9.9, 10.0, 11.0])
    assert not any(support.stands(time) for time in times)
    assert [support.borne(time) for time in times] == pytest.approx([1.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    medium = np.array([support.resistance(time) for time in times])
    assert medium[:2] == pytest.approx(3.0)
    assert (np.diff(medium[1:6]) < 0.0).all()
    assert 0.0 < medium[4] < 0.05  # hardly anything has to move once it is gone
    assert not medium[5:].any()
