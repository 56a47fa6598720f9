"""Winding numbers of shapes whose inside is known."""

import numpy as np
import pytest
import trimesh

from warpjld.geometry.winding import winding_numbers


def test_closed_open_and_nested_surfaces() -> None:
    """A capsule of radius 8 mm, its axis from the origin to (0, 0, 0.04)."""
    mesh = trimesh.creation.capsule(height=0.04, radius=0.008, count=(48, 48))
    faces = np.array(mesh.faces)
    vertices = np.array(mesh.vertices) - [0, 0, mesh.vertices[:, 2].min() + 0.008]
    points = np.array([[0, 0, 0.02], [0.004, 0, 0.0], [0, 0, 0.1], [0.02, 0, 0.02]])
    np.testing.assert_allclose(winding_numbers(vertices, faces, points), [1, 1, 0, 0], atol=1e-9)
    both = np.vstack([faces, faces + len(vertices)])
    inner = np.vstack([vertices, vertices * 0.5])
    assert winding_numbers(inner, both, np.array([[0, 0, 0.01]]))[0] == pytest.approx(2.0, abs=1e-9)
    opened = faces[vertices[faces].mean(axis=1)[:, 2] > 0.0]
    assert winding_numbers(vertices, opened, points[:1])[0] > 0.8


def test_inside_and_outside_far_from_the_origin() -> None:
    random = np.random.default_rng(0)
    mesh = trimesh.creation.icosphere(subdivisions=1)
    points = random.normal(size=(50, 3))
    inside = np.linalg.norm(points, axis=1) < 0.85
    outside = np.linalg.norm(points, axis=1) > 1.0
    got = winding_numbers(np.array(mesh.vertices) + 5.0, np.array(mesh.faces), points + 5.0)
    np.testing.assert_allclose(got[inside], 1.0, atol=1e-9)
    np.testing.assert_allclose(got[outside], 0.0, atol=1e-9)
