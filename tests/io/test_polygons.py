"""Triangles of polygons cover what the polygons do: areas by the shoelace formula, in any plane."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from warpjld.io.polygons import triangulate_polygons


def areas(points: np.ndarray, triangles: np.ndarray, normal: np.ndarray) -> np.ndarray:
    a, b, c = points[triangles.T]
    return np.cross(b - a, c - a) @ normal / 2.0


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), counts=st.lists(st.integers(3, 12), min_size=1, max_size=6))
def test_star_shaped_polygons_are_covered_once(seed: int, counts: list[int]) -> None:
    """Spikes in and out around a middle; every triangle is turned as the polygon is, so their areas cannot cancel."""
    random = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(random.normal(size=3)).as_matrix()
    rings, wanted = [], []
    for count in counts:
        angle = 2 * np.pi * (np.arange(count) + random.uniform(0.1, 0.9, count)) / count
        # from a third on the middle may lie outside of a triangle, but not of what is star-shaped about it
        flat = random.uniform(0.3, 1.0, count)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        x, y = flat.T
        wanted.append(0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
        rings.append(np.column_stack([flat, np.zeros(count)]) @ turn.T + random.normal(size=3))
    points = np.concatenate(rings)
    triangles, owner = triangulate_polygons(points, np.array(counts))
    np.testing.assert_array_equal(np.bincount(owner, minlength=len(counts)), np.array(counts) - 2)
    assert (np.diff(owner) >= 0).all()
    starts = np.cumsum(counts) - counts
    assert (triangles >= starts[owner, None]).all()
    assert (triangles < (starts + counts)[owner, None]).all()
    signed = areas(points, triangles, turn[:, 2])
    np.testing.assert_allclose(np.bincount(owner, signed), wanted, rtol=1e-9)
    assert (signed > -1e-12).all()


def test_corners_on_a_straight_edge_stay() -> None:
    """A corner left out would be a hole beside the neighbour that has it."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    triangles, _ = triangulate_polygons(points, np.array([5]))
    assert set(triangles.ravel()) == set(range(5))
    np.testing.assert_allclose(areas(points, triangles, np.array([0, 0, 1.0])).sum(), 4.0)


def test_too_few_corners_give_nothing() -> None:
    triangles, owner = triangulate_polygons(np.eye(3)[[0, 1, 0, 1, 2]], np.array([2, 3, 0]))
    np.testing.assert_array_equal(triangles, [[2, 3, 4]])
    np.testing.assert_array_equal(owner, [1])
