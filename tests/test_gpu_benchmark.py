"""The benchmark of GPUs runs: here on the CPU, with small sizes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.benchmarks.gpu import main


@pytest.mark.slow
def test_every_row_is_measured(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["--device", "cpu", "--small", "--json", str(tmp_path / "gpu.json")])
    assert done.exit_code == 0, done.output
    rows = json.loads((tmp_path / "gpu.json").read_text())["rows"]
    beginnings = ("covering, on", "covering, with", "distances", "searches", "grasps", "conjugate gradients")
    assert [row["what"].startswith(word) for row, word in zip(rows, beginnings, strict=True)] == [True] * len(rows)
    assert all(row["device"] > 0.0 and row["cpu"] > 0.0 for row in rows)
    assert rows[0]["share"] > 0.0
