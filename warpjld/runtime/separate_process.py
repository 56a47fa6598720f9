"""The process in which files are read by libraries that may crash: started when first needed, kept, and ended."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from pathlib import Path

__all__ = ["LATE", "end_process", "running_process"]

LATE = "late"
"""What is answered where nothing was in time."""
_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from warpjld.runtime.separate_program import serve; serve(sys.argv[2])"
)
_ONE_THREAD = {"PXR_WORK_THREAD_LIMIT": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Threads reserve memory each, which would count against the limit on machines with many processors."""
_ENDING = 5.0  # time for a process that closed its pipe to end by itself, so that its exit code is known [s]


class _Process:
    """A process, and the folder in which it leaves arrays."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="warpjld-read-"))
        self._owner = os.getpid()
        self._popen = subprocess.Popen(
            [sys.executable, "-P", "-c", _START, json.dumps(sys.path), str(self.folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            encoding="ascii",
            env=os.environ | _ONE_THREAD,
        )

    @property
    def pid(self) -> int:
        """Its number."""
        return self._popen.pid

    def usable(self) -> bool:
        """Whether it runs, and is this process's own: a fork must not use its parent's."""
        return self._owner == os.getpid() and self._popen.poll() is None and self.folder.is_dir()

    def asked(self, request: str, seconds: float) -> str:
        """Its answer, a line; without an end of line where it died, ``LATE`` where it was not in time."""
        if self._popen.stdin is None or self._popen.stdout is None:
            raise RuntimeError("the process has no pipes")
        late = threading.Event()

        def stop() -> None:
            late.set()
            self._popen.kill()

        timer = threading.Timer(seconds, stop)
        timer.daemon = True
        timer.start()
        try:
            with suppress(BrokenPipeError):
                self._popen.stdin.write(request + "\n")
                self._popen.stdin.flush()
            line = self._popen.stdout.readline()
        except BaseException:  # Ctrl-C: its answer would be taken for the next one's
            self.end()
            raise
        finally:
            timer.cancel()
        return LATE if late.is_set() and not line.endswith("\n") else line

    def end(self) -> int:
        """Its exit code, after it was killed if it does not end by itself; its folder is removed."""
        if self._owner != os.getpid():
            return 0
        for pipe in (self._popen.stdin, self._popen.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()
        with suppress(subprocess.TimeoutExpired):
            self._popen.wait(_ENDING)
        self._popen.kill()
        shutil.rmtree(self.folder, ignore_errors=True)
        return self._popen.wait()


_process: _Process | None = None


def running_process() -> _Process:
    """The process that is kept, or a new one."""
    global _process
    if _process is None or not _process.usable():
        if _process is not None:
            _process.end()
        _process = _Process()
    return _process


@atexit.register
def end_process() -> None:
    """End the process that is kept, if there is one."""
    if _process is not None:
        _process.end()
