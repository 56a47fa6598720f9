"""Rays, sections and extremities against shapes whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.skeleton.recognise.extremity import find_extremity
from warpjld.skeleton.recognise.section import cross_section, first_hits, skin_hits


@pytest.fixture(scope="module")
def capsule() -> tuple[np.ndarray, np.ndarray]:
    """Radius 8 mm, axis from the origin to (0, 0, 0.04)."""
    mesh = trimesh.creation.capsule(height=0.04, radius=0.008, count=(48, 48))
    vertices = np.array(mesh.vertices)
    return vertices - [0, 0, vertices[:, 2].min() + 0.008], np.array(mesh.faces)


def test_first_hits_from_inside_a_box():
    mesh = trimesh.creation.box((2.0, 4.0, 6.0))
    directions = np.vstack([np.eye(3), -np.eye(3)])
    origins = np.tile([0.25, 0.5, 1.0], (6, 1))
    hits = first_hits(np.array(mesh.vertices), np.array(mesh.faces), origins, directions)
    np.testing.assert_allclose(hits, [0.75, 1.5, 2.0, 1.25, 2.5, 4.0])
    away = first_hits(np.array(mesh.vertices), np.array(mesh.faces), origins + 10, directions[:1])
    assert np.isinf(away[0])


def test_flesh_of_overlapping_pieces_ends_where_the_last_ends():
    """Two boxes: a ray from the one, or from both, goes on to the end of the other; from outside it meets the first."""
    one = trimesh.creation.box((2.0, 2.0, 2.0))
    other = trimesh.creation.box((2.0, 1.0, 1.0), transform=trimesh.transformations.translation_matrix([1.5, 0, 0]))
    mesh = trimesh.util.concatenate([one, other])
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces)
    origins = np.array([[0.0, 0.1, 0.2], [0.75, 0.0, 0.0], [-2.0, 0.1, 0.2], [0.0, 0.8, 0.0]])
    way = np.tile([1.0, 0.0, 0.0], (4, 1))
    np.testing.assert_allclose(skin_hits(vertices, faces, origins, way), [2.5, 1.75, 1.0, 1.0])
    np.testing.assert_allclose(first_hits(vertices, faces, origins, way), [0.5, 0.25, 1.0, 1.0])
    assert np.isinf(skin_hits(vertices, faces, origins[2:3], -way[:1])).all()


def test_a_section_finds_the_centre_from_an_eccentric_point(capsule):
    section = cross_section(*capsule, np.array([0.003, -0.002, 0.02]), np.array([0.0, 0.0, 1.0]), rays=96)
    np.testing.assert_allclose(section.centre, [0, 0, 0.02], atol=1e-4)
    assert section.radius == pytest.approx(0.008, rel=0.02)
    assert section.seen == 1.0


@pytest.mark.parametrize("aside", [0.0, 0.002])
def test_the_extremity_of_a_capsule_is_the_centre_of_its_round_end(capsule, aside):
    tip = find_extremity(*capsule, np.array([aside, 0.0, 0.01]), np.array([0.0, 0.0, 1.0]), 0.03)
    np.testing.assert_allclose(tip, [0, 0, 0.04], atol=1e-3)


def test_no_extremity_where_nothing_is_in_the_way(capsule):
    assert find_extremity(*capsule, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]), 0.03) is None
