"""Placing a palm: what was drawn is where the palm goes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.grasp.palm import Palm
from warpjld.study.grasping.plan import WristRange
from warpjld.study.grasping.wrist import draw_approach, place_palm

PALM = Palm(np.array([0.01, -0.02, -0.06]), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, -1.0]), 0.08)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_palm_comes_to_its_point_facing_the_object(seed: int) -> None:
    approach = draw_approach(WristRange(tilt=(0.0, 30.0)), np.random.default_rng(seed), np.full(3, 0.05))
    point = np.array([0.1, 0.2, 0.3])
    turn, shift = place_palm(PALM, approach, point)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert turn @ PALM.middle + shift == pytest.approx(point)
    # the palm's normal makes the angle drawn with the line of approach
    cosine = (turn @ PALM.normal) @ -approach.direction
    assert np.arccos(np.clip(cosine, -1.0, 1.0)) == pytest.approx(approach.tilt, abs=1e-6)
    assert approach.direction @ approach.fingers == pytest.approx(0.0, abs=1e-12)


def test_draws_keep_to_their_ranges_and_are_even_over_the_sphere() -> None:
    ranges = WristRange(elevation=(-90.0, 90.0), gap=(0.01, 0.02), offset=(0.5, 0.5), tilt=(5.0, 6.0))
    rng, extent = np.random.default_rng(0), np.array([0.02, 0.04, 0.06])
    drawn = [draw_approach(ranges, rng, extent) for _ in range(4000)]
    directions = np.array([a.direction for a in drawn])
    # the mean of an even distribution over the sphere is 0, each coordinate's variance 1/3
    assert np.abs(directions.mean(axis=0)).max() < 0.04
    assert directions.var(axis=0) == pytest.approx(np.full(3, 1 / 3), abs=0.02)
    assert all(0.01 <= a.gap <= 0.02 and 5.0 <= np.degrees(a.tilt) <= 6.0 for a in drawn)
    aside = np.array([a.aim for a in drawn]) / (extent / 2.0)
    assert np.linalg.norm(aside, axis=1) == pytest.approx(np.full(4000, 0.5))


def test_elevation_is_where_the_hand_comes_from() -> None:
    above = WristRange(elevation=(90.0, 90.0))
    front = WristRange(elevation=(0.0, 0.0), azimuth=(0.0, 0.0))
    rng = np.random.default_rng(1)
    assert draw_approach(above, rng, np.ones(3)).direction == pytest.approx([0, 1, 0], abs=1e-7)
    assert draw_approach(front, rng, np.ones(3)).direction == pytest.approx([0, 0, 1], abs=1e-7)
