"""Standard streams that are closed, full, or read by nobody any more: what is made is made, and no traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="streams are closed by a POSIX shell here")


def shell(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A line for /bin/sh in which P is the program."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "P": f"{sys.executable} -m warpjld"}
    return subprocess.run(["/bin/sh", "-c", line], cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.parametrize("closed", ["2>&-", "<&- >&- 2>&-"])
def test_what_is_asked_for_is_made(tmp_path: Path, closed: str) -> None:
    (tmp_path / "m.csv").write_text("frame,index.base.flexion\n0,0\n1,40\n")
    done = shell(f"$P deform builtin:left --motion m.csv --motion-out m.bvh {closed}", tmp_path)
    assert done.returncode == 0
    assert (tmp_path / "m.bvh").read_text().startswith("HIERARCHY")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
def test_a_full_disk_behind_stdout_is_one_line(tmp_path: Path) -> None:
    done = shell("$P example > /dev/full", tmp_path)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("error: ")
    assert "No space left" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_reader_that_leaves(tmp_path: Path) -> None:
    done = shell("$P --help | head -c 5", tmp_path)
    assert done.stdout == "Usage"
    assert "Traceback" not in done.stderr
