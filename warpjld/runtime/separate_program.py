"""Program of the process that :mod:`warpjld.runtime.separate` starts: calls functions, a line of JSON each.

A call may use a stated amount of memory beyond what the process holds once it has imported what it needs. After an
exception that is no refusal the process ends, since the library that raised it may be in any state.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import threading
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.reading import reading
from warpjld.limits import variable
from warpjld.runtime.lazily import imported

__all__ = ["serve"]

_IDLE = 20.0  # time without a request after which the process ends [s]
_BASE = 1 << 30  # address space of the interpreter and its libraries where it cannot be measured [bytes]


def serve(folder: str) -> None:
    """Answer the requests on stdin until it is closed; what libraries print is dropped."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles Ctrl-C
    with os.fdopen(os.dup(1), "w", encoding="ascii", buffering=1) as answers:
        os.dup2(2, 1)
        while request := _request():
            answer, sound = _answered(json.loads(request), Path(folder))
            try:
                print(json.dumps(answer), file=answers)
            except BrokenPipeError:
                break
            if not sound:
                break
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)  # libraries may crash while they clean up


def _request() -> str:
    idle = threading.Timer(_IDLE, os._exit, (0,))
    idle.daemon = True
    idle.start()
    line = sys.stdin.readline()
    idle.cancel()
    return line


def _answered(request: dict[str, Any], folder: Path) -> tuple[dict[str, Any], bool]:
    """The answer, and whether the process can go on."""
    for name in [name for name in os.environ if name.startswith(variable(""))]:
        del os.environ[name]
    os.environ.update(request["limits"])
    path = Path(request["path"])
    try:
        with reading(path, request["kind"], but=MemoryError):
            function = imported(request["place"])
            _bound_memory(request["memory"])
            return {"value": function(folder, path, *request["arguments"])}, True
    except InputError as error:
        return _refused(error), not isinstance(error.__cause__, RuntimeError)
    except MemoryError:
        _bound_memory(None)
        return {"memory": True}, False
    finally:
        _bound_memory(None)


def _refused(error: InputError) -> dict[str, Any]:
    place = None if error.path is None else str(error.path)
    return {"refused": {"message": error.message, "path": place, "line": error.line, "column": error.column}}


def _bound_memory(more: int | None) -> None:
    """Limit the address space to what is used now and some bytes more; None to lift the limit."""
    try:
        import resource
    except ImportError:  # not available on Windows
        return
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    soft = hard
    if more is not None:
        soft = _used() + more if hard == resource.RLIM_INFINITY else min(_used() + more, hard)
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _used() -> int:
    try:
        return int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return _BASE
