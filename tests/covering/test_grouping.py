"""Vertices are grouped into runs whole, with the columns they read, cheaply, and the packed coefficients are theirs."""

from __future__ import annotations

import time

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from warpjld.covering import bind
from warpjld.covering.grouping import FIXED, group, work
from warpjld.covering.runs import Columns, pack
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig
from warpjld.skeleton import CHANNELS, poses_from_angles


def _strip(vertices: int, columns: int, seed: int) -> sp.csr_array:
    """Neighbours read mostly the same columns, as along limbs: a window that moves, with some of it left out."""
    random = np.random.default_rng(seed)
    first = np.sort(random.integers(0, columns, vertices))
    entries = (first[:, None] + np.arange(9)) % columns
    kept = random.random(entries.shape) < 0.7
    row = np.repeat(np.arange(vertices), 9).reshape(vertices, 9)
    out = sp.coo_array((np.ones(kept.sum()), (row[kept], entries[kept])), shape=(vertices, columns)).tocsr()
    out.sum_duplicates()
    return out


@settings(derandomize=True, deadline=None, max_examples=40)
@given(st.integers(1, 700), st.integers(1, 60), st.integers(0, 9), st.sampled_from([1, 16, 32]))
def test_runs_hold_every_vertex_once_and_exactly_what_they_read(count: int, width: int, seed: int, lanes: int) -> None:
    used = _strip(count, width, seed)
    members, columns = group(used, np.ones(width), lanes)
    for vertices, read in zip(members, columns, strict=True):
        assert len(vertices) >= lanes
        np.testing.assert_array_equal(read, np.unique(used[vertices].indices))
    everyone = np.concatenate(members)
    if count >= lanes:
        np.testing.assert_array_equal(np.sort(everyone), np.arange(count))
    else:
        assert set(everyone.tolist()) == set(range(count))


def test_thousands_of_different_rows_are_grouped_at_once_and_little_is_wasted() -> None:
    used = _strip(25_000, 150, 3)
    price = np.ones(150) * 3.5
    began = time.process_time()
    members, columns = group(used, price, 32)
    assert time.process_time() - began < 2.0  # .2 s alone; quadratic Python took more than ten
    needed = 25_000 * FIXED + used.nnz * 3.5
    assert work(members, columns, price, 32) < 1.5 * needed


@pytest.mark.parametrize("count", [5, 32, 400])
def test_packed_runs_give_back_every_coefficient(count: int) -> None:
    columns, random = Columns(6, 5, 2), np.random.default_rng(1)
    dense = random.random((4, count, columns.width)) * (random.random((4, count, columns.width)) < 0.05)
    dense[0, :, columns.muscles :] = 0.0
    dense[1:, :, : columns.muscles] = 0.0
    offset = random.random((count, 3)).astype(np.float32)
    runs = pack(sp.csr_array(dense[0]), [sp.csr_array(d) for d in dense[1:]], offset, columns, 32)
    back, offsets = np.zeros_like(dense), np.full((count, 3), np.nan)
    for lane0, length, first, slot, joints, rotations, scales, muscles in runs.runs.tolist():
        plain = joints + rotations + scales
        rows = runs.coefficients[first:].reshape(-1)[: (plain + 3 + 3 * muscles) * length].reshape(-1, length)
        vertices, read = runs.order[lane0 : lane0 + length], runs.slots[slot : slot + plain + muscles]
        back[0][np.ix_(vertices, read[:plain])] = rows[:plain].T
        offsets[vertices] = rows[plain : plain + 3].T
        for axis in range(3):
            back[1 + axis][np.ix_(vertices, read[plain:])] = rows[plain + 3 + axis :: 3].T
    np.testing.assert_array_equal(back, dense.astype(np.float32))
    np.testing.assert_array_equal(offsets, offset)


def test_rows_written_through_the_buffer_are_those_of_the_runs(
    hands: dict[str, Rig], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks of frames that do not divide the batch, rows at any address, and a surface smaller than one tile."""
    hand = hands["left"]
    faces = np.array([[0, 1, 2], [2, 3, 4], [4, 5, 6]], dtype=np.int32)
    few = Surface(hand.surface.vertices[:7], faces, np.arange(7, dtype=np.int32), faces)
    monkeypatch.setattr("warpjld.covering.launch._BUFFERED", 1)
    for surface in (hand.surface, few):
        covering = bind(hand.skeleton, surface)
        angles = np.random.default_rng(2).uniform(0.0, 0.3, (21, len(hand.skeleton), len(CHANNELS)))
        poses = poses_from_angles(hand.skeleton, angles)
        runs, count = covering.deform(poses, order="runs"), len(surface.vertices)
        expected = np.empty_like(runs)
        expected[:, covering.runs.order[:count]] = runs
        for threads in (1, 2):
            np.testing.assert_array_equal(covering.deform(poses, threads=threads), expected)
