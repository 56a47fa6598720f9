"""Broken meshes bind with finite weights, small and large, and painted weights with holes are filled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.covering.tube import bend, tube, tube_skeleton
from warpjld.covering import bind, heat
from warpjld.covering.binding import OPERATORS, anchor
from warpjld.covering.corners import corner_conductivity
from warpjld.covering.operators import fans
from warpjld.covering.parameters import default_parameters
from warpjld.errors import InputError
from warpjld.geometry.spread import spread
from warpjld.geometry.surface import Surface
from warpjld.rig import Skin
from warpjld.skeleton import CHANNELS, Skeleton

Mesh = tuple[np.ndarray, np.ndarray]
Fault = Callable[[np.ndarray, np.ndarray, np.random.Generator], Mesh]


def raw(vertices: np.ndarray, faces: np.ndarray) -> Surface:
    """A surface as it is: nothing is welded, no face without area taken out."""
    faces = faces.astype(np.int32)
    return Surface(vertices, faces, np.arange(len(vertices), dtype=np.int32), faces)


def duplicated(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v, np.concatenate([f, f, f[::2, ::-1]])


def zero_area(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v, np.concatenate([f, f[:, [0, 0, 1]]])


def collapsed(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    out = v.copy()
    out[rng.integers(0, len(v), len(v) // 2)] = v[0]
    return out, f


def inverted(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v, np.where(rng.random(len(f))[:, None] < 0.5, f, f[:, ::-1])


def t_junctions(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    """One side of every third edge is split, the other is not."""
    a, b, c = f[::3].T
    middle = len(v) + np.arange(len(a))
    halves = [np.column_stack([a, middle, c]), np.column_stack([middle, b, c])]
    return np.concatenate([v, (v[a] + v[b]) / 2.0]), np.concatenate([np.delete(f, np.s_[::3], axis=0), *halves])


def isolated(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return np.concatenate([v, rng.normal(scale=0.05, size=(20, 3))]), f


def soup(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v[f].reshape(-1, 3), np.arange(3 * len(f)).reshape(-1, 3)


def crumpled(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v + rng.normal(scale=0.02, size=v.shape), f


def tangled(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v, rng.integers(0, len(v), f.shape)


def spiked(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    out = v.copy()
    out[rng.integers(0, len(v), 5)] += 1e7
    return out, f


def away(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v + np.array([100.0, 0.0, 0.0]), f


def huge(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v * 1e10, f


def flat(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v * [0.0, 0.0, 1.0], f


def point(v: np.ndarray, f: np.ndarray, rng: np.random.Generator) -> Mesh:
    return v * 0.0, f


FAULTS = [duplicated, zero_area, collapsed, inverted, t_junctions, isolated, soup, crumpled, tangled, spiked, away]
FAULTS += [huge, flat, point]


def check(surface: Surface) -> None:
    skeleton = tube_skeleton()
    covering = bind(skeleton, surface)
    assert np.isfinite(covering.domains).all()
    assert (covering.domains >= 0.0).all()
    assert np.abs(covering.domains.sum(axis=1) - 1.0).max() < 1e-9
    assert np.isfinite(covering.deform(bend(skeleton, [0.0, 70.0]))).all()


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.lists(st.sampled_from(FAULTS), min_size=1, max_size=3), st.integers(0, 2**31))
def test_broken_meshes_bind(faults: list[Fault], seed: int) -> None:
    start = tube(rings=12, around=10)
    mesh = (start.vertices, start.faces)
    rng = np.random.default_rng(seed)
    for fault in faults:
        mesh = fault(*mesh, rng)
    check(raw(*mesh))


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_alone(fault: Fault) -> None:
    start = tube(rings=12, around=10)
    check(raw(*fault(start.vertices, start.faces, np.random.default_rng(1))))


@pytest.mark.parametrize("fault", [crumpled, spiked, away, flat])
def test_large_ones_settle_too(fault: Fault, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is beyond the direct solver: multigrid, or what comes after it."""
    monkeypatch.setattr(heat, "_DIRECT_LIMIT", 100)
    start = tube(rings=60, around=24)
    check(raw(*fault(start.vertices, start.faces, np.random.default_rng(1))))


def test_multigrid_that_fails_is_followed_by_another(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> np.ndarray:
        raise ArithmeticError("did not settle")

    monkeypatch.setattr(heat, "_multigrid", fails)
    monkeypatch.setattr(heat, "_DIRECT_LIMIT", 100)
    matrix = sp.diags_array([2.0 * np.ones(200), -np.ones(199), -np.ones(199)], offsets=[0, 1, -1])
    wanted = np.random.default_rng(0).normal(size=(200, 2))
    found = heat.solve_diffusion(matrix, matrix @ wanted)
    assert found is not None
    assert np.abs(found - wanted).max() < 1e-3


def test_what_cannot_be_solved_says_what_to_try(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("warpjld.covering.domains.solve_diffusion", lambda *_: None)
    with pytest.raises(InputError, match="--domains skin"):
        bind(tube_skeleton(), tube(rings=12, around=10))


def test_doubled_faces_change_nothing() -> None:
    start, skeleton = tube(rings=21, around=12), tube_skeleton()
    doubled = raw(*duplicated(start.vertices, start.faces, np.random.default_rng(0)))
    assert np.abs(bind(skeleton, start).domains - bind(skeleton, doubled).domains).max() < 1e-5


def test_conductivity_of_crowded_corners_is_finite() -> None:
    start = tube(rings=60, around=24)
    vertices, faces = crumpled(start.vertices, start.faces, np.random.default_rng(3))
    vertices[::3] = vertices[0]
    conductivity = corner_conductivity(vertices, faces, np.full(len(vertices), 0.01))
    assert np.isfinite(conductivity).all()
    assert conductivity.min() >= 1.0


def star(count: int) -> Skeleton:
    """A root with as many segments around it, all alike."""
    angle = 2.0 * np.pi * np.arange(count) / count
    rest = np.concatenate([np.zeros((1, 3)), 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])])
    parents = np.array([-1] + [0] * count, dtype=np.int32)
    names = ("root", *(f"tip{k}" for k in range(count)))
    return Skeleton(
        names, parents, rest, np.tile([0.0, 0.0, 1.0], (count + 1, 1)), np.zeros((count + 1, len(CHANNELS), 2))
    )


@pytest.mark.parametrize("count", [3, 4, 5, 6, 12])
def test_operators_that_share_a_vertex_alike(count: int) -> None:
    """Five equal weights faded one another to nothing, and nothing by nothing is not a number."""
    skeleton = star(count)
    groups = fans(skeleton)
    equal = np.full((2, count), 1.0 / count)
    anchors = anchor(
        np.array([[0.0, 0.0, 0.02], [0.0, 0.0, -0.02]]), skeleton, groups, equal, default_parameters(skeleton)
    )
    assert np.isfinite(anchors.weight).all()
    assert np.abs(anchors.weight.sum(axis=1) - 1.0).max() < 1e-12
    used = anchors.segment[:, : min(count, OPERATORS)]
    assert np.array_equal(used, np.tile(np.arange(min(count, OPERATORS)), (2, 1)))


def test_skin_of_many_helpers_is_finite() -> None:
    """All weight on a joint that carries many equal bones, as helpers at one place make it."""
    skeleton, surface = star(7), tube(rings=12, around=10)
    painted = Skin(np.zeros((len(surface.vertices), 1), np.int32), np.ones((len(surface.vertices), 1)))
    surface.vertices[:] *= 1e-3
    covering = bind(skeleton, surface, skin=painted, domains="skin")
    assert np.isfinite(covering.anchors.weight).all()


def test_bare_vertices_follow_their_neighbours() -> None:
    skeleton, surface = tube_skeleton(), tube(rings=21, around=12)
    along = np.clip((-surface.vertices[:, 2] / 0.03 - 0.5), 0.0, 1.0)
    joints = np.tile(np.array([[0, 1]], np.int32), (len(along), 1))
    weights = np.column_stack([1.0 - along, along])
    full = bind(skeleton, surface, skin=Skin(joints, weights), domains="skin").domains
    holes = np.random.default_rng(4).choice(len(along), 25, replace=False)
    weights = weights.copy()
    weights[holes] = 0.0
    filled = bind(skeleton, surface, skin=Skin(joints, weights), domains="skin").domains
    assert np.isfinite(filled).all()
    assert np.abs(filled.sum(axis=1) - 1.0).max() < 1e-9
    assert np.abs(filled - full)[holes].max() < 0.1  # a ring of the tube further is .1
    kept = np.setdiff1d(np.arange(len(along)), holes)
    assert np.array_equal(filled[kept], full[kept])


def test_no_weight_at_all_is_said() -> None:
    surface = tube(rings=12, around=10)
    nothing = Skin(np.zeros((len(surface.vertices), 1), np.int32), np.zeros((len(surface.vertices), 1)))
    with pytest.raises(InputError, match="no vertex has painted weight"):
        bind(tube_skeleton(), surface, skin=nothing, domains="skin")


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.integers(0, 2**31), st.floats(0.02, 0.98))
def test_spread_stays_within_what_is_known(seed: int, share: float) -> None:
    surface = tube(rings=10, around=8)
    rng = np.random.default_rng(seed)
    values = rng.dirichlet(np.ones(3), len(surface.vertices))
    known = rng.random(len(values)) < share
    known[rng.integers(len(values))] = True
    values[~known] = np.nan
    out = spread(values, known, surface.vertices, surface.faces)
    assert np.array_equal(out[known], values[known])
    assert out.min() >= values[known].min() - 1e-12
    assert out.max() <= values[known].max() + 1e-12
    assert np.abs(out.sum(axis=1) - 1.0).max() < 1e-9


def test_spread_is_linear_along_a_line() -> None:
    """Between two known ends of a strip whose ends are 0 and 1, a mean of neighbours is the place along it."""
    n = 12
    x = np.linspace(0.0, 1.0, n)
    vertices = np.concatenate([np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x, 0 * x + 1.0, 0 * x])])
    k = np.arange(n - 1)
    faces = np.concatenate([np.column_stack([k, k + 1, k + n]), np.column_stack([k + 1, k + n + 1, k + n])])
    known = np.isin(vertices[:, 0], (0.0, 1.0))
    out = spread(np.where(known, vertices[:, 0], np.nan)[:, None], known, vertices, faces)[:, 0]
    assert np.abs(out[:n] + out[n:][::-1] - 1.0).max() < 1e-6  # the strip turned about its middle is itself
    assert (np.diff(out[:n]) > 0.0).all()


def test_pieces_without_any_known_vertex_take_the_nearest() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0], [9.0, 0, 0]])
    known = np.array([True, True, False, False, False, False, False])
    out = spread(np.array([[0.0], [1.0]] + [[np.nan]] * 5), known, vertices, np.array([[0, 1, 2], [3, 4, 5]]))[:, 0]
    assert out[3:].tolist() == [1.0] * 4
    assert 0.0 < out[2] < 0.5  # the edge to the vertex of value 0 is the shorter one
