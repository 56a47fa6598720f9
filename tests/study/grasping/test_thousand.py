"""A thousand real trials, stopped as harshly as can be, against a thousand that nothing disturbed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
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


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("pyarrow")
    path = tmp_path_factory.mktemp("plan") / "study.toml"
    path.write_text(_PLAN)
    return path


@pytest.fixture(scope="module")
def whole(plan: Path) -> Path:
    """All trials in one process that nothing disturbs."""
    assert _started(plan, plan.parent / "whole", processes=1).wait() == 0
    return plan.parent / "whole"


@pytest.mark.slow
def test_a_thousand_trials_in_two_processes(plan: Path, whole: Path, tmp_path: Path) -> None:
    assert _started(plan, tmp_path, processes=2).wait() == 0
    _check_same(tmp_path, whole)
    rows = read_table(whole / "table.parquet")
    assert [row["trial"] for row in rows] == list(range(_TRIALS))
    assert all(row["status"] != "error" for row in rows)
    assert sum(row["status"] == "closed" for row in rows) > 0.9 * _TRIALS


@pytest.mark.slow
def test_a_thousand_trials_killed_half_way(plan: Path, whole: Path, tmp_path: Path) -> None:
    study = _started(plan, tmp_path, processes=3)
    while _finished(tmp_path) < _TRIALS // 2:
        assert study.poll() is None, "the study ended before it could be killed"
        time.sleep(0.02)
    os.killpg(study.pid, signal.SIGKILL)  # its workers with it, whatever they are writing
    study.wait()
    assert _TRIALS // 2 <= _finished(tmp_path) < _TRIALS
    assert not (tmp_path / "table.parquet").exists()
    assert _started(plan, tmp_path, processes=2).wait() == 0
    _check_same(tmp_path, whole)


@pytest.mark.slow
@pytest.mark.parametrize("killed", [False, True])
def test_a_thousand_trials_on_ray(plan: Path, whole: Path, tmp_path: Path, killed: bool) -> None:
    pytest.importorskip("ray")
    study = _started(plan, tmp_path, 2, "--ray", "local")
    if killed:
        while _finished(tmp_path) < _TRIALS // 4:
            assert study.poll() is None, "the study ended before a worker could be killed"
            time.sleep(0.02)
        workers = [pid for pid, name in _descendants(study.pid) if name.startswith("ray::trial_bytes")]
        os.kill(workers[0], signal.SIGKILL)
    assert study.wait() == 0
    _check_same(tmp_path, whole)


def _check_same(one: Path, other: Path) -> None:
    for name in _RESULTS:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def _descendants(root: int) -> list[tuple[int, str]]:
    """Processes below one, and their command lines."""
    parents: dict[int, tuple[int, str]] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            parents[int(folder.name)] = parent, (folder / "cmdline").read_text()
    found = []
    for pid, (parent, name) in parents.items():
        while parent in parents and parent != root:
            parent = parents[parent][0]
        if parent == root:
            found.append((pid, name))
    return found


def _started(plan: Path, out: Path, processes: int, *more: str) -> subprocess.Popen[bytes]:
    """The command, leading a process group of its own."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(_ROOT), str(_ROOT / "kernels")])}
    options = ["-o", str(out), "--processes", str(processes), "--table", "both", "--quiet", *more]
    command = [sys.executable, "-m", "warpjld", "study", str(plan), *options]
    return subprocess.Popen(command, cwd=_ROOT, env=environment, start_new_session=True)


def _finished(out: Path) -> int:
    return sum(1 for _ in (out / "trials").glob("*/*.json"))
