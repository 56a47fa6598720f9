"""Measures of a deformation against surfaces whose volume and stretch are known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.covering.tube import AROUND, RADIUS, SEGMENT, tube
from warpjld.covering.quality import (
    Stretch,
    closing_fans,
    edge_stretch,
    enclosed_volume,
    reversed_edges,
    reversed_faces,
    unique_edges,
)

EXACT = 1e-12  # float64 sums of some thousand terms
PRISM = 0.5 * AROUND * np.sin(2.0 * np.pi / AROUND) * RADIUS**2 * 2.0 * SEGMENT
SURFACE = tube()
NO_TURN = np.tile([0.0, 0.0, 0.0, 1.0], (len(SURFACE.vertices), 1))


def test_volume_of_a_prism() -> None:
    assert enclosed_volume(SURFACE.vertices, SURFACE.faces) == pytest.approx(PRISM, rel=EXACT)


def test_open_ends_are_closed_by_fans() -> None:
    sides = SURFACE.faces[: -2 * AROUND]
    boundary, loop = closing_fans(sides)
    assert len(boundary) == 2 * AROUND
    assert sorted(np.bincount(loop)) == [AROUND, AROUND]
    assert enclosed_volume(SURFACE.vertices, sides) == pytest.approx(PRISM, rel=EXACT)
    assert not len(closing_fans(SURFACE.faces)[0])


@settings(max_examples=25, deadline=None)
@given(
    scale=st.floats(0.1, 10.0),
    turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    move=st.tuples(*[st.floats(-100.0, 100.0)] * 3),
)
def test_volume_and_stretch_of_similar_surfaces(scale: float, turn: tuple, move: tuple) -> None:
    moved = scale * Rotation.from_rotvec(turn).apply(SURFACE.vertices) + move
    frames = np.stack([SURFACE.vertices, moved])
    np.testing.assert_allclose(
        enclosed_volume(frames, SURFACE.faces), [PRISM, scale**3 * PRISM], rtol=1e-8
    )  # 100 m away a millimetre keeps 11 digits
    ratios = edge_stretch(SURFACE.vertices, frames, unique_edges(SURFACE.faces))
    np.testing.assert_allclose(ratios[0], 1.0)
    np.testing.assert_allclose(ratios[1], scale, rtol=1e-8)


def test_edges_of_a_closed_surface() -> None:
    edges = unique_edges(SURFACE.faces)
    assert len(SURFACE.vertices) - len(edges) + len(SURFACE.faces) == 2, "Euler"
    assert (edges[:, 0] < edges[:, 1]).all()


def test_stretch_is_summed_up_by_its_tails() -> None:
    stretch = Stretch.of(np.concatenate([[0.1], np.linspace(0.5, 1.5, 1001), [3.0]]))
    assert (stretch.smallest, stretch.largest) == (0.1, 3.0)
    assert stretch.low == pytest.approx(0.51, abs=2e-3)
    assert stretch.high == pytest.approx(1.49, abs=2e-3)


def test_a_section_that_passes_its_neighbour_reverses_the_edges_between() -> None:
    moved = SURFACE.vertices.copy()
    ring = slice(10 * AROUND, 11 * AROUND)
    moved[ring, 2] -= 1.5 * 2.0 * SEGMENT / 60
    edges = unique_edges(SURFACE.faces)
    found = edges[reversed_edges(SURFACE.vertices, moved, edges, NO_TURN)]
    along = np.abs(found[:, 0] // AROUND - found[:, 1] // AROUND)
    assert (along == 1).all()
    assert set((found // AROUND).ravel()) == {10, 11}
    assert len(found) >= AROUND
    assert reversed_faces(SURFACE.vertices, moved, SURFACE.faces, NO_TURN).any()


def test_a_rotation_reverses_nothing_it_carries() -> None:
    turn = Rotation.from_rotvec([0.3, 2.9, -0.4])
    moved = turn.apply(SURFACE.vertices)
    rotations = np.tile(turn.as_quat(), (len(moved), 1))
    edges = unique_edges(SURFACE.faces)
    assert not reversed_edges(SURFACE.vertices, moved, edges, rotations).any()
    assert not reversed_faces(SURFACE.vertices, moved, SURFACE.faces, rotations).any()
    assert reversed_edges(SURFACE.vertices, moved, edges, NO_TURN).any()
