"""Rays that hit triangles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from warpjld.geometry.ray import ray_hit
from warpjld.grasp.shapes import ball

_BALL = ball(0.08, subdivisions=5)
_CORNERS = _BALL.vertices[_BALL.faces]


def test_a_ray_meets_a_ball_where_it_is() -> None:
    met = ray_hit(_CORNERS, np.array([0.3, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]))
    assert met is not None
    assert met[0] == pytest.approx(0.26, abs=1e-4)
    assert ray_hit(_CORNERS, np.array([0.3, 0.1, 0.0]), np.array([-1.0, 0.0, 0.0])) is None
    assert ray_hit(_CORNERS, np.array([0.3, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])) is None


@given(st.integers(0, 10_000))
def test_the_first_of_several_is_met_from_either_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    origin = rng.normal(size=3)
    triangle = rng.normal(size=(3, 3))
    u, v = rng.uniform(0.05, 0.45, 2)
    point = triangle[0] + u * (triangle[1] - triangle[0]) + v * (triangle[2] - triangle[0])
    triangles = np.stack([triangle + (point - origin), triangle])
    if rng.random() < 0.5:
        triangles = triangles[:, ::-1]
    met = ray_hit(triangles, origin, point - origin)
    assert met is not None
    assert met[1] == 1
    assert met[0] == pytest.approx(1.0, abs=1e-6)
