from __future__ import annotations

import numpy as np
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.geometry.normals import vertex_normals

# float32 results
TOLERANCE = 1e-6


def test_sphere_normals_are_radial() -> None:
    errors = []
    for level in (2, 3, 4):
        sphere = trimesh.creation.icosphere(subdivisions=level)
        errors.append(np.abs(vertex_normals(sphere.vertices, sphere.faces) - sphere.vertices).max())
    # first order in the edge length, which halves with each level
    assert errors[0] / errors[1] > 1.7
    assert errors[1] / errors[2] > 1.7


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.floats(1e-3, 1e3))
def test_turn_with_the_surface_and_ignore_its_size(seed: int, scale: float) -> None:
    box = trimesh.creation.icosphere(subdivisions=1)
    turn = trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))[:3, :3]
    turned = vertex_normals(scale * box.vertices @ turn.T, box.faces)
    np.testing.assert_allclose(turned, vertex_normals(box.vertices, box.faces) @ turn.T, atol=TOLERANCE)


def test_no_area_gives_a_unit_vector() -> None:
    normals = vertex_normals(np.zeros((4, 3)), np.array([[0, 1, 2]]))
    np.testing.assert_array_equal(np.linalg.norm(normals, axis=1), 1)
