"""Points within balls, beside SciPy's tree."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from warpjld.geometry.within_balls import within_balls


@pytest.mark.parametrize(("points", "balls", "size"), [(4000, 60, 0.1), (300, 20, 0.5), (500, 3, 1e-4), (9, 4, 0.0)])
def test_pairs_are_those_of_a_tree(points: int, balls: int, size: float) -> None:
    """Every pair, ball by ball, for radii that differ thirtyfold; a ball of radius 0 on a point holds it."""
    random = np.random.default_rng(points)
    places = random.normal(size=(points, 3)) * (0.2, 0.1, 0.5)
    centres = random.choice(places, balls) + random.normal(size=(balls, 3)) * 0.1 * size
    radii = size * random.uniform(0.1, 3.0, balls)
    ball, near = within_balls(places, centres, radii, 10**9)
    tree = cKDTree(places)
    wanted = [(b, p) for b, found in enumerate(tree.query_ball_point(centres, radii)) for p in sorted(found)]
    assert sorted(zip(ball.tolist(), near.tolist(), strict=True)) == wanted
    assert (np.diff(ball) >= 0).all()


def test_whole_balls_up_to_the_most_pairs() -> None:
    """Balls after the first that would exceed the number have no pairs, though they would fit by themselves."""
    places = np.zeros((10, 3))
    places[8:] = 1.0
    centres = np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    ball, near = within_balls(places, centres, np.full(3, 0.1), 5)
    assert ball.tolist() == [0, 0]
    assert sorted(near.tolist()) == [8, 9]


def test_balls_that_cross_many_cells_are_complete() -> None:
    """One ball as large as everything among many tiny ones."""
    random = np.random.default_rng(1)
    places = random.uniform(size=(200, 3))
    radii = np.r_[2.0, np.full(50, 1e-9)]
    ball, near = within_balls(places, places[:51], radii, 10**6)
    assert np.array_equal(np.sort(near[ball == 0]), np.arange(200))
    assert np.array_equal(near[ball > 0], np.arange(1, 51))
