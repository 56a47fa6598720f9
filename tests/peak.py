"""The most memory that the program holds, whatever the tests hold."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_START = """
import os, subprocess, sys
process = subprocess.Popen([sys.executable, "-m", "warpjld", *sys.argv[1:]], stdout=subprocess.DEVNULL)
_, status, used = os.wait4(process.pid, 0)
assert os.waitstatus_to_exitcode(status) == 0
print(used.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / 1e6)
"""
"""A small program between: on Linux a process counts what the one that starts it held."""


def peak(*arguments: str, folder: Path) -> float:
    """Run the program in a folder; the largest resident set of its processes [MB, 10⁶ bytes]."""
    environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    call = [sys.executable, "-c", _START, *arguments]
    return float(subprocess.run(call, cwd=folder, env=environment, stdout=subprocess.PIPE, check=True).stdout)
