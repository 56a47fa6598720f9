"""Fields are diffused a few at a time: the same fields, in less memory."""

from __future__ import annotations

import tracemalloc

import pytest

import warpjld as wj
from warpjld.covering import diffusion
from warpjld.covering.fields import joint_of_column, operator_fields


def test_fields_do_not_depend_on_how_many_are_diffused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    covering = wj.bind(wj.build_hand("left", resolution=6_000))
    fields = operator_fields(covering.anchors, covering.parameters).stacked()
    owner = joint_of_column(covering.anchors, len(covering.skeleton))
    monkeypatch.setattr(diffusion, "cores", lambda: 1)
    found, peaks = [], []
    covering.diffusion.spread(fields, owner)  # factorisations are kept
    for block in (10**9, 0):
        monkeypatch.setattr(diffusion, "_BLOCK", block)
        tracemalloc.start()
        found.append(covering.diffusion.spread(fields, owner))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert (found[0] != found[1]).nnz == 0
    assert peaks[1] < 0.9 * peaks[0]
