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
    assert smoother.steps == 8
    np.testing.assert_allclose(smoother.of(np.full(len(VERTICES), 3.0)), 3.0)
    kinked = np.abs(VERTICES)
    smooth = smoother.of(kinked)
    assert np.abs(smooth - kinked).max() < 2.0 * EDGE
    assert smooth.min() > 0.3 * EDGE  # at the kink
    assert smooth.max() <= 1.0


def test_a_surface_coarser_than_elements_is_left_alone() -> None:
    smoother = SurfaceSmoother(VERTICES, FACES, 0.5 * EDGE)
    values = np.random.default_rng(3).normal(size=len(VERTICES))
    np.testing.assert_array_equal(smoother.of(values), values)
