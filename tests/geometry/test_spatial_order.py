"""Points in the order of a curve: all of them, neighbours near each other."""

import numpy as np

from warpjld.geometry.spatial_order import spatial_order


def test_neighbours_on_the_curve_are_near() -> None:
    points = np.random.default_rng(0).uniform(-0.1, 0.1, size=(4096, 3)).astype(np.float32)
    order = spatial_order(points)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(points)))
    step = np.median(np.linalg.norm(np.diff(points[order], axis=0), axis=1))
    # sixteen points along a side of the cube, 12.5 mm apart
    assert step < 0.02 < 0.1 < np.median(np.linalg.norm(np.diff(points, axis=0), axis=1))


def test_points_in_one_place() -> None:
    assert spatial_order(np.zeros((3, 3))).tolist() == [0, 1, 2]
