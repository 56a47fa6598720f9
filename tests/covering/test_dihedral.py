"""Dihedral angles and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.covering.tube import tube
from warpjld.covering.dihedral import dihedral_angles, dihedral_slopes, hinges


@pytest.mark.parametrize("degrees", [-170.0, -90.0, -1.0, 0.0, 30.0, 90.0, 179.0])
def test_two_faces_folded_by_an_angle(degrees: float) -> None:
    angle = np.radians(degrees)
    points = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0.3], [-np.cos(angle), np.sin(angle), 0.6]])
    hinge = hinges(np.array([[0, 1, 2], [1, 0, 3]]))
    np.testing.assert_array_equal(hinge, [[0, 1, 2, 3]])
    assert dihedral_angles(points, hinge) == pytest.approx([abs(angle)])


def test_rims_and_faces_turned_against_each_other_have_no_hinge() -> None:
    assert not len(hinges(np.array([[0, 1, 2], [0, 1, 3]])))
    surface = tube(rings=4, around=6)
    closed = hinges(surface.faces)
    assert len(closed) == 3 * len(surface.faces) // 2
    assert len(hinges(surface.faces[:-6])) == len(closed) - 2 * 6, "a cap less: its rim, and its spokes"
    assert hinges(np.zeros((0, 3), dtype=np.int32)).shape == (0, 4)


@given(st.integers(0, 10_000))
@settings(derandomize=True, max_examples=25, deadline=None)
def test_slopes(seed: int) -> None:
    surface = tube(rings=5, around=7)
    rng = np.random.default_rng(seed)
    points = surface.vertices + 1e-3 * rng.normal(size=surface.vertices.shape)
    hinge = hinges(surface.faces)
    direction = rng.normal(size=points.shape)
    step = 1e-9
    there, back = (dihedral_angles(points + s * direction, hinge) for s in (step, -step))
    found = (dihedral_slopes(points, hinge, np.zeros((len(hinge), 2))) * direction[hinge]).sum(axis=(1, 2))
    angles = dihedral_angles(points, hinge)
    smooth = (angles > 1e-2) & (angles < np.pi - 1e-2)  # where nothing turns over
    np.testing.assert_allclose(found[smooth], ((there - back) / (2.0 * step))[smooth], rtol=1e-3, atol=1.0)


def test_faces_that_vanish_do_not_blow_up() -> None:
    points = np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, 0.3], [-1.0, 0.5, 0.6]])
    hinge = np.array([[0, 1, 2, 3]])
    least = np.full((1, 2), 0.05)
    assert np.abs(dihedral_slopes(points, hinge, least)).max() <= 1.0 / 0.05 + 1e-9
