"""Fields are diffused a few at a time: the same fields, in less memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
import scipy.sparse as sp

import warpjld as wj
from warpjld.covering import diffusion, heat
from warpjld.covering.fields import joint_of_column, operator_fields
from warpjld.covering.laplacian import cotangent_laplacian
from warpjld.geometry.spatial_order import spatial_order
from warpjld.rig import Rig


def test_fields_do_not_depend_on_how_many_are_diffused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    covering = wj.bind(wj.build_hand("left", resolution=6_000))
    fields = operator_fields(covering.anchors, covering.parameters).stacked()
    owner = joint_of_column(covering.anchors, len(covering.skeleton))
    monkeypatch.setattr(heat, "cores", lambda: 1)
    found, peaks = [], []
    covering.diffusion.spread(fields, owner)  # factorisations are kept
    for block in (10**9, 0):
        monkeypatch.setattr(heat, "_BLOCK", block)
        tracemalloc.start()
        found.append(covering.diffusion.spread(fields, owner))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert (found[0] != found[1]).nnz == 0
    assert peaks[1] < 0.9 * peaks[0]


def test_heat_does_not_depend_on_how_many_columns_are_solved_at_once(
    built: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And beside the solution memory does not grow with their number."""
    hand = built.surface
    laplacian, area = cotangent_laplacian(hand.vertices, hand.faces, np.full(len(hand.vertices), 0.01))
    matrix, order, count = laplacian + sp.diags_array(area * 1e4), spatial_order(hand.vertices), len(area)
    column = np.random.default_rng(0).integers(0, 120, count)
    right = sp.coo_array((area, (np.arange(count), column)), shape=(count, 120))
    monkeypatch.setattr(heat, "cores", lambda: 1)
    heat.solve_diffusion(matrix, right, order)
    found, peaks = [], []
    for block in (10**9, 0):
        monkeypatch.setattr(heat, "_BLOCK", block)
        tracemalloc.start()
        found.append(heat.solve_diffusion(matrix, right, order))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert found[0] is not None
    assert np.array_equal(found[0], found[1])
    np.testing.assert_allclose(matrix @ found[0], right.toarray(), atol=1e-9 * area.max())
    assert peaks[1] < 0.5 * peaks[0]
    assert peaks[1] < 2.0 * found[0].nbytes


def test_a_column_that_is_solved_wrongly_among_others_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """In whichever block of columns it is, the next solver is asked, and then there is no solution."""
    matrix = sp.csr_array(np.diag([2.0, 3.0, 4.0]))
    monkeypatch.setattr(heat, "_BLOCK", 0)
    monkeypatch.setattr(heat, "cores", lambda: 1)
    right, asked = np.ones((3, 30)), []

    def wrong(_matrix: sp.csc_array, _scale: np.ndarray) -> heat._Solve:
        def solve(some: np.ndarray) -> np.ndarray:
            asked.append(some.shape[1])
            return some if len(asked) < 4 else some + 1e-3

        return solve

    monkeypatch.setattr(heat, "_direct", wrong)
    found = heat.solve_diffusion(matrix, right)
    assert found is not None
    np.testing.assert_allclose(matrix @ found, right, rtol=1e-6)
    assert asked == [8, 8, 8, 6]
    asked.clear()
    monkeypatch.setattr(heat, "_plain", wrong)
    asked += [0] * 3
    assert heat.solve_diffusion(matrix, right) is None


def test_fields_do_not_depend_on_how_many_regions_are_factorised_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    covering = wj.bind(wj.build_hand("left", resolution=6_000))
    fields = operator_fields(covering.anchors, covering.parameters).stacked()
    owner = joint_of_column(covering.anchors, len(covering.skeleton))
    monkeypatch.setattr(diffusion, "_SHARED", 0.0)  # every joint has its own
    found = []
    for cores in (1, 3):
        monkeypatch.setattr("warpjld.runtime.threads.cores", lambda cores=cores: cores)
        flesh = diffusion.Diffusion(
            covering.diffusion.vertices, covering.diffusion.faces, covering.diffusion.radius, covering.diffusion.flesh
        )
        found.append(flesh.spread(fields, owner))
        assert all(len(regions) > 1 for regions in flesh._cache.values())
    assert (found[0] != found[1]).nnz == 0


def test_what_is_no_flesh_keeps_its_fields() -> None:
    """Columns that only rigid vertices have, or no vertex, as well; rows are sorted, so that sums have one order."""
    covering = wj.bind(wj.build_hand("left", resolution=1_500))
    fields = operator_fields(covering.anchors, covering.parameters).stacked()
    owner = joint_of_column(covering.anchors, len(covering.skeleton))
    rigid = sp.random_array((7, fields.shape[1] + 3), density=0.1, format="csr", rng=np.random.default_rng(0))
    rigid = sp.csr_array(rigid @ sp.diags_array(np.r_[np.ones(fields.shape[1] + 2), 0.0]))
    wider = sp.hstack([fields, sp.csr_array((fields.shape[0], 3))])
    together = sp.csr_array(sp.vstack([wider, rigid]))
    found = covering.diffusion.spread(together, np.r_[owner, 0, 0, 0])
    assert found.shape == together.shape
    assert (found[-7:] != rigid).nnz == 0
    assert rigid[:, fields.shape[1] :].nnz > 0
    assert (found[:-7, :-3] != covering.diffusion.spread(fields, owner)).nnz == 0
    assert found[:-7, -3:].nnz == 0
    assert sp.csr_array((found.data, found.indices, found.indptr), shape=found.shape).has_sorted_indices
