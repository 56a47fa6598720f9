"""A thousand real trials, stopped as harshly as can be, against a thousand that nothing disturbed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from warpjld.tables.files import read_table

_ROOT = Path(__file__).resolve().parents[3]
_TRIALS = 1000
_RESULTS = ("table.parquet", "table.csv", "poses.npz")

_PLAN = f"""seed = 7
trials = {_TRIALS}
friction = [0.5, 0.9]
scales = [0.9, 1.1]
[[hands]]
name = "hand"
builtin = "right"
resolution = 1500
[[objects]]
builtin = "ball"
[[objects]]
builtin = "cylinder"
[wrist]
elevation = [-10, 60]
"""


@pytest.mark.slow
def test_a_thousand_trials_killed_half_way_give_the_same_bytes(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    plan = tmp_path / "study.toml"
    plan.write_text(_PLAN)
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert _started(plan, whole, processes=2).wait() == 0

    study = _started(plan, cut, processes=3)
    while _finished(cut) < _TRIALS // 2:
        assert study.poll() is None, "the study ended before it could be killed"
        time.sleep(0.02)
    os.killpg(study.pid, signal.SIGKILL)  # its workers with it, whatever they are writing
    study.wait()
    stopped = _finished(cut)
    assert _TRIALS // 2 <= stopped < _TRIALS
    assert not (cut / "table.parquet").exists()

    assert _started(plan, cut, processes=2).wait() == 0
    for name in _RESULTS:
        assert (cut / name).read_bytes() == (whole / name).read_bytes(), name
    rows = read_table(cut / "table.parquet")
    assert [row["trial"] for row in rows] == list(range(_TRIALS))
    assert all(row["status"] != "error" for row in rows)
    assert sum(row["status"] == "closed" for row in rows) > 0.9 * _TRIALS


@pytest.mark.slow
def test_a_thousand_trials_on_ray_give_the_same_bytes(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    pytest.importorskip("ray")
    plan = tmp_path / "study.toml"
    plan.write_text(_PLAN)
    here, there = tmp_path / "here", tmp_path / "there"
    assert _started(plan, here, processes=1).wait() == 0
    assert _started(plan, there, 2, "--ray", "local").wait() == 0
    for name in _RESULTS:
        assert (here / name).read_bytes() == (there / name).read_bytes(), name


def _started(plan: Path, out: Path, processes: int, *more: str) -> subprocess.Popen[bytes]:
    """The command, leading a process group of its own."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), str(_ROOT / "kernels")])}
    options = ["-o", str(out), "--processes", str(processes), "--table", "both", "--quiet", *more]
    command = [sys.executable, "-m", "warpjld", "study", str(plan), *options]
    return subprocess.Popen(command, cwd=_ROOT, env=environment, start_new_session=True)


def _finished(out: Path) -> int:
    return sum(1 for _ in (out / "trials").glob("*/*.json"))
