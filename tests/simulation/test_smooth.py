"""Fields on visible surfaces lose their kinks, not their size."""

from __future__ import annotations

import numpy as np
import trimesh

from warpjld.simulation.display.smooth import SurfaceSmoother

MESH = trimesh.creation.icosphere(4)
VERTICES, FACES = np.asarray(MESH.vertices), np.asarray(MESH.faces)
EDGE = float(np.median(MESH.edges_unique_length))


def test_kinks_go_and_what_is_even_stays() -> None:
    smoother = SurfaceSmoother(VERTICES, FACES, 2.0 * EDGE)
    np.testing.assert_allclose(smoother.of(np.full(len(VERTICES), 3.0)), 3.0)
    kinked = np.abs(VERTICES)
    smooth = smoother.of(kinked)
    assert np.abs(smooth - kinked).max() < 2.0 * EDGE
    assert smooth.min() > 0.3 * EDGE  # at the kink
    assert smooth.max() <= 1.0


def test_linear_fields_stay_on_uneven_triangles() -> None:
    """A square whose vertices lie at random, slivers among them: away from its border nothing moves along it."""
    from scipy.spatial import Delaunay

    points = np.random.default_rng(7).uniform(0.0, 1.0, size=(3000, 2))
    flat = np.column_stack([points, np.zeros(len(points))])
    faces = Delaunay(points).simplices.astype(np.int32)
    edge = 0.04
    smooth = SurfaceSmoother(flat, faces, edge).of(flat)
    inner = (np.abs(points - 0.5) < 0.5 - 6.0 * edge).all(axis=1)
    assert np.linalg.norm((smooth - flat)[inner], axis=1).max() < 1e-3 * edge


def test_a_surface_coarser_than_elements_is_left_alone() -> None:
    smoother = SurfaceSmoother(VERTICES, FACES, 0.5 * EDGE)
    values = np.random.default_rng(3).normal(size=len(VERTICES))
    np.testing.assert_array_equal(smoother.of(values), values)
