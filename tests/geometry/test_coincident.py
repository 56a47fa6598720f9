"""Points in the same place and what hangs together, against SciPy's k-d tree and graph search."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from warpjld.errors import InputError
from warpjld.geometry.coincident import close_links, close_pairs, connected_parts

_seeds = st.integers(0, 2**32 - 1)


def _as_set(pairs: np.ndarray) -> set[tuple[int, int]]:
    return {(min(p), max(p)) for p in pairs.tolist()}


@settings(derandomize=True, deadline=None, max_examples=60)
@given(_seeds, st.integers(0, 60), st.integers(1, 4), st.sampled_from([1.0, 1e-6, 1e5]))
def test_pairs_are_those_of_a_tree(seed: int, count: int, cells: int, far: float) -> None:
    """Points on a coarse grid, in many of whose places several lie, shaken by less and by more than the distance."""
    random = np.random.default_rng(seed)
    points = random.integers(0, cells, (count, 3)) + random.choice([0.0, 2e-4, 9e-4], (count, 3))
    points = far * (points + 0.3)
    expected = cKDTree(points).query_pairs(far * 1e-3, output_type="ndarray") if count else np.zeros((0, 2))
    found = close_pairs(points, far * 1e-3)
    assert len(found) == len(_as_set(found))
    assert _as_set(found) == _as_set(expected)
    assert (found[:, 0] < found[:, 1]).all()


@pytest.mark.parametrize("direction", [*np.eye(3).tolist(), [1.0, 1.0, 0.0], [0.5257, 0.6180, 0.5846]])
def test_twice_the_same_points_in_a_plane(direction: list[float]) -> None:
    normal = np.array(direction)
    random = np.random.default_rng(0)
    points = random.uniform(-1.0, 1.0, (400, 3))
    points -= (points @ normal)[:, None] * normal / (normal @ normal)  # a plane, all of which is alike along its normal
    points = np.concatenate([points, points[:50]])
    assert _as_set(close_pairs(points, 1e-9)) == {(k, 400 + k) for k in range(50)}


@settings(derandomize=True, deadline=None, max_examples=60)
@given(_seeds, st.integers(1, 60), st.integers(1, 4))
def test_links_connect_what_all_pairs_connect(seed: int, count: int, cells: int) -> None:
    random = np.random.default_rng(seed)
    points = random.integers(0, cells, (count, 3)) + random.choice([0.0, 0.0, 2e-4, 9e-4], (count, 3))
    links, pairs = close_links(points, 1e-3), close_pairs(points, 1e-3)
    assert _as_set(links) <= _as_set(pairs)
    np.testing.assert_array_equal(connected_parts(links, count), connected_parts(pairs, count))


def test_many_points_in_one_place_are_few_links_and_no_more_pairs_than_the_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    places = np.random.default_rng(0).normal(size=(20, 3))
    points = np.tile(places, (5_000, 1))
    links = close_links(points, 1e-6)
    assert len(links) == len(points) - len(places)
    np.testing.assert_array_equal(connected_parts(links, len(points)), np.arange(len(points)) % 20)
    monkeypatch.setenv("WARPJLD_LIMIT_PAIRS", "1000000")
    with pytest.raises(InputError, match=r"the limit is 1,000,000 .*pairs="):
        close_pairs(points, 1e-6)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(_seeds, st.integers(1, 80), st.integers(0, 120))
def test_parts_are_those_of_a_graph(seed: int, count: int, links: int) -> None:
    random = np.random.default_rng(seed)
    pairs = random.integers(0, count, (links, 2))
    graph = coo_array((np.ones(links), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    np.testing.assert_array_equal(connected_parts(pairs, count), connected_components(graph, directed=False)[1])


@pytest.mark.parametrize("order", ["forwards", "backwards", "shuffled"])
def test_a_long_chain_is_one_part(order: str) -> None:
    count = 20_000
    number = np.arange(count)
    if order == "backwards":
        number = number[::-1]
    elif order == "shuffled":
        number = np.random.default_rng(0).permutation(count)
    assert not connected_parts(np.column_stack([number[:-1], number[1:]]), count).any()
