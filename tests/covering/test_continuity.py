"""The surface is continuous for every pose: finer meshes do not stretch more (R18, R68)."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from tests.covering.poses import random_angles
from tests.covering.subdivision import edges, stretches, subdivided
from warpjld.covering import bind
from warpjld.covering.corners import corner_conductivity
from warpjld.geometry.surface import weld_surface
from warpjld.rig import Rig
from warpjld.skeleton import poses_from_angles

GROWTH = 1.05  # per halving of the edges: a discontinuity doubles the stretch, a corner's spike adds a tenth or more


def growth(rig: Rig, up_to: int, method: Literal["smooth", "paper"] = "smooth") -> list[float]:
    """Ratio of the largest stretch over random poses from each level of subdivision to the next."""
    poses = poses_from_angles(rig.skeleton, random_angles(rig.skeleton, 24, 17))
    largest, surface = [], rig.surface
    while len(surface.vertices) <= up_to:
        largest.append(stretches(bind(rig.skeleton, surface, method=method), poses).max())
        surface = subdivided(surface)
    assert len(largest) > 1
    return (np.array(largest[1:]) / largest[:-1]).tolist()


def test_built_in_hand_does_not_tear(built: Rig) -> None:
    assert max(growth(built, 12_000)) <= GROWTH


def test_webxr_hand_does_not_tear(webxr_hands: dict[str, Rig]) -> None:
    assert max(growth(webxr_hands["left"], 6_000)) <= GROWTH


def test_hard_edges_tear(built: Rig) -> None:
    assert max(growth(built, 12_000, "paper")) > 1.5


@pytest.mark.slow
@pytest.mark.parametrize("side", ["left", "right"])
def test_webxr_hand_to_300k_vertices(webxr_hands: dict[str, Rig], side: str) -> None:
    assert max(growth(webxr_hands[side], 300_000)) <= GROWTH


@pytest.mark.slow
def test_built_in_hand_to_300k_vertices() -> None:
    from warpjld.hand import build_hand

    assert max(growth(build_hand("left", resolution=4_500), 300_000)) <= GROWTH


def test_subdivision_keeps_the_shape(built: Rig) -> None:
    finer = subdivided(built.surface)
    old, new = edges(built.surface.faces), edges(finer.faces)
    assert len(finer.vertices) == len(built.surface.vertices) + len(old)
    assert len(finer.faces) == 4 * len(built.surface.faces)
    assert len(new) == 2 * len(old) + 3 * len(built.surface.faces)


@pytest.mark.parametrize("height", [0.0, 0.3])
def test_conductivity_is_raised_around_saddle_corners_only(height: float) -> None:
    """Eight triangles round a vertex, their rim rising and falling, and a far one."""
    around = np.pi / 4 * np.arange(8)
    level = np.sqrt(1.0 - height**2)
    rim = np.column_stack([level * np.cos(around), level * np.sin(around), height * (-1.0) ** np.arange(8)])
    far = [[1000.0, 0.0, 0.0], [1001.0, 0.0, 0.0], [1000.0, 1.0, 0.0]]
    faces = np.array([*((0, 1 + k, 1 + (k + 1) % 8) for k in range(8)), (9, 10, 11)], dtype=np.int32)
    thickness = np.full(12, 40.0)
    got = corner_conductivity(np.concatenate([np.zeros((1, 3)), rim, far]), faces, thickness)
    turns = 8 * np.arccos(rim[0] @ rim[1]) / (2 * np.pi)
    assert got[8] == 1.0
    assert np.ptp(got[:8]) < 1e-12
    if height:
        assert turns > 1.1
        # conductivity falls with the distance r as r^β; heat then goes as r^ν with ν (ν + β) = (2π/θ)²
        wider = corner_conductivity(np.concatenate([np.zeros((1, 3)), 2 * rim, far]), faces, thickness)
        beta = np.log2(wider[0] / got[0])
        nu = -beta / 2 + np.sqrt(beta**2 / 4 + turns**-2)
        assert 1.0 <= nu < 1.2, "the slope of r^ν stays finite"
    else:
        assert got[0] == 1.0


def test_how_large_the_surface_is_elsewhere_does_not_matter(built: Rig) -> None:
    """A hand on a body is bound as a hand alone: its webs once conducted heat as far as a share of all there is."""
    surface, count = built.surface, len(built.surface.vertices)
    far = surface.vertices.mean(axis=0) + np.array([[2.0, 0.0, 0.0], [2.0, 0.1, 0.0], [2.0, 0.0, 0.1]])
    vertices = np.concatenate([surface.vertices, far])
    faces = np.concatenate([surface.faces, [[count, count + 1, count + 2]]]).astype(np.int32)
    alone, beside = (bind(built.skeleton, s) for s in (surface, weld_surface(vertices, faces)))
    assert len(beside.surface.vertices) == count + 3
    np.testing.assert_allclose(beside.domains[:count], alone.domains, atol=2e-3)
    np.testing.assert_allclose(beside.spread.positions.toarray()[:count], alone.spread.positions.toarray(), atol=2e-3)
