"""The implicit hand: a distance near its surface, smooth, engraved where asked."""

from dataclasses import replace

import numpy as np
import pytest

from warpjld.hand.fit import fit_plan
from warpjld.hand.flesh import PlannedFlesh
from warpjld.hand.sweep import section_distance
from warpjld.hand.triangulate import triangulate


@pytest.fixture(scope="module")
def flesh() -> PlannedFlesh:
    return PlannedFlesh(fit_plan(190.0, 85.0, {}))


@pytest.fixture(scope="module")
def surface(flesh: PlannedFlesh) -> np.ndarray:
    return triangulate(flesh, 4000)[0]


def test_section_of_a_circle_is_a_distance() -> None:
    angle = np.linspace(0.0, 6.0, 50)
    for radius in (0.5, 1.0, 1.5):
        got = section_distance(
            4.0 * radius * np.cos(angle), 4.0 * radius * np.sin(angle), 0.0 * angle, 0.0 * angle + 4.0,
            0.0 * angle + 4.0, 1.0, 0.0,
        )  # fmt: skip
        np.testing.assert_allclose(got, 4.0 * (radius - 1.0), atol=1e-6)


def test_vertices_lie_on_the_surface(flesh: PlannedFlesh, surface: np.ndarray) -> None:
    assert np.abs(flesh(surface)).max() < 0.01


def test_slope_is_near_one_at_the_surface(flesh: PlannedFlesh, surface: np.ndarray) -> None:
    slope = np.linalg.norm(flesh.slope(surface)[1], axis=1)
    assert np.percentile(slope, [1, 99]) == pytest.approx([1.0, 1.0], abs=0.35)


def test_normals_turn_gradually(flesh: PlannedFlesh, surface: np.ndarray) -> None:
    normal = flesh.slope(surface)[1]
    step = np.cross(normal, np.roll(normal, 1, axis=1))
    nearby = flesh.project(surface + 0.1 * step / np.linalg.norm(step, axis=1, keepdims=True))
    other = flesh.slope(nearby)[1]
    cosine = np.einsum("ij,ij->i", normal, other) / np.linalg.norm(normal, axis=1) / np.linalg.norm(other, axis=1)
    assert np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max() < 12.0  # over a tenth of a millimetre: no crease


def test_nails_are_shallow_and_dorsal(flesh: PlannedFlesh, surface: np.ndarray) -> None:
    change = replace(flesh, detail=1.0)(surface) - flesh(surface)
    assert 0.05 < np.abs(change).max() < 0.6  # millimetres
    engraved = np.abs(change) > 0.02
    joints = {name: digit.joints for name, digit in flesh.plan.digits.items()}
    last = np.concatenate([points[2:] for points in joints.values()])
    far = np.linalg.norm(surface[engraved, None] - last, axis=2).min(axis=1)
    assert far.max() < 16.0, "only on last phalanges"
