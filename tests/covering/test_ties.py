"""What rounding differs by from processor to processor decides nothing: borders and ties have a rule."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
import scipy.sparse as sp

from tests.covering.tube import tube, tube_skeleton
from warpjld.covering import bind, heat
from warpjld.covering.domains import domains_from_geometry
from warpjld.covering.laplacian import cotangent_laplacian
from warpjld.covering.operators import fans
from warpjld.covering.paper_places import PaperPlaces, paper_places
from warpjld.covering.parameters import default_parameters
from warpjld.covering.segment_table import SegmentTable
from warpjld.geometry.spatial_order import spatial_order
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig
from warpjld.skeleton import Skeleton

ROUNDING = 1e-13  # relative to the size: more than sums in another order or fused operations differ by


def shaken(vertices: np.ndarray, seed: int, by: float) -> np.ndarray:
    size = np.linalg.norm(np.ptp(vertices, axis=0))
    return vertices + by * size * np.random.default_rng(seed).uniform(-1.0, 1.0, vertices.shape)


def on_borders(skeleton: Skeleton, surface: Surface) -> Surface:
    """The surface with vertices moved to where the paper's areas and operators meet."""
    vertices = surface.vertices.copy()
    groups = fans(skeleton)
    table = SegmentTable.build(skeleton, np.array([(s.proximal, s.distal) for g in groups for s in g.segments]))
    rng = np.random.default_rng(8)
    height = 0.1 * surface.size
    at = iter(rng.permutation(len(vertices)))
    for s in range(len(table.ends)):
        normal, along = table.normals[s, 0], table.along[s]
        across = np.cross(along / np.linalg.norm(along), normal)
        for ratio in (0.0, 0.3, 1.0):  # level with the segment, over it, at its ends
            vertices[next(at)] = table.start[s] + ratio * along + height * across
            vertices[next(at)] = table.start[s] + ratio * along + height * normal
    for s in range(len(table.ends) - 1):  # half-way between two
        vertices[next(at)] = (table.start[s] + table.start[s + 1] + table.along[s] + table.along[s + 1]) / 2.0
    return replace(surface, vertices=vertices)


def places(rig: Rig, vertices: np.ndarray, domains: np.ndarray) -> PaperPlaces:
    skeleton = rig.skeleton
    return paper_places(vertices, skeleton, fans(skeleton), domains, default_parameters(skeleton))


def check(rig: Rig) -> None:
    surface = on_borders(rig.skeleton, rig.surface)
    domains = domains_from_geometry(rig.surface.vertices, rig.surface.faces, rig.skeleton, fans(rig.skeleton))
    # every third vertex belongs to the palm, where most borders are; every fifth to two operators alike
    domains[::3] = np.eye(domains.shape[1])[0]
    domains[::5] = 0.0
    domains[::5, [0, 1]] = 0.5
    wanted = places(rig, surface.vertices, domains)
    for seed in range(5):
        noise = 1e-13 * np.random.default_rng(seed).uniform(-1.0, 1.0, domains.shape)
        found = places(rig, shaken(surface.vertices, seed, ROUNDING), domains + noise)
        for field in fields(wanted):
            before, after = getattr(wanted, field.name), getattr(found, field.name)
            assert np.abs(before.astype(float) - after.astype(float)).max() < 1e-6, field.name


def test_paper_places_of_the_built_in_hand(built: Rig) -> None:
    check(built)


def test_paper_places_of_a_webxr_hand(webxr_hands: dict[str, Rig]) -> None:
    check(webxr_hands["left"])


def test_equally_near_segments() -> None:
    """Vertices over a joint are as far from the one segment as from the other: float32 must not choose."""
    surface, skeleton = tube(rings=31, around=16), tube_skeleton()
    groups = fans(skeleton)
    wanted = domains_from_geometry(surface.vertices, surface.faces, skeleton, groups)
    assert (np.abs(surface.vertices[:, 2] + 0.03) < 1e-12).sum() == 16  # a ring right over the joint
    for seed in range(4):
        found = domains_from_geometry(shaken(surface.vertices, seed, 1e-7), surface.faces, skeleton, groups)
        assert np.abs(found - wanted).max() < 1e-4


def test_the_normal_of_a_segment_along_an_axis() -> None:
    """Where the flexion axis lies along the segment any normal does, but the same one on every processor."""
    skeleton = tube_skeleton()
    along = replace(skeleton, axes=np.tile([0.0, 0.0, 1.0], (3, 1)))
    ends = np.array([[0, 1]], dtype=np.int32)
    wanted = SegmentTable.build(along, ends).normals
    for k in range(3):
        for sign in (-1.0, 1.0):
            rest = along.rest.copy()
            rest[1, k] += sign * 1e-17 + sign * 1e-15 * (k < 2)
            found = SegmentTable.build(replace(along, rest=rest), ends).normals
            assert np.abs(found - wanted).max() < 1e-6


@pytest.mark.parametrize("method", ["smooth", "paper"])
def test_binding_twice_gives_the_same_bits(webxr_hands: dict[str, Rig], method: str) -> None:
    rig = webxr_hands["right"]
    first, second = (bind(rig.skeleton, rig.surface, method=method) for _ in range(2))  # type: ignore[arg-type]
    assert np.array_equal(first.domains, second.domains)
    assert np.array_equal(first.anchors.weight, second.anchors.weight)


def test_multigrid_does_not_depend_on_what_was_drawn_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """It begins from random vectors: they must not be those that a program has come to, nor change what comes next."""
    monkeypatch.setattr(heat, "_DIRECT_LIMIT", 100)
    surface, skeleton = tube(rings=60, around=24), tube_skeleton()
    np.random.seed(1)  # noqa: NPY002 - the state that pyamg draws from
    first, after = bind(skeleton, surface).domains, np.random.rand()  # noqa: NPY002
    np.random.seed(1)  # noqa: NPY002
    assert np.random.rand() == after  # noqa: NPY002
    assert np.array_equal(bind(skeleton, surface).domains, first)


def test_heat_does_not_depend_on_the_order_its_equations_are_solved_in(built: Rig) -> None:
    hand = built.surface
    laplacian, area = cotangent_laplacian(hand.vertices, hand.faces, np.full(len(hand.vertices), 0.01))
    right = np.random.default_rng(0).random((len(area), 3)) * area[:, None]
    order = spatial_order(hand.vertices)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(area)))
    matrix = laplacian + sp.diags_array(area * 100.0)
    found, plain = heat.solve_diffusion(matrix, right, order), heat.solve_diffusion(matrix, right)
    assert found is not None
    assert plain is not None
    np.testing.assert_allclose(found, plain, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(matrix @ found, right, atol=1e-9 * right.max())
