"""The program: ``warpjld``, or ``python -m warpjld``."""

from __future__ import annotations

import atexit
import gc
import os
import sys
import threading
from typing import NoReturn

from warpjld.cli import main
from warpjld.cli.warn import plain_warnings

__all__ = ["run"]

_OBJECTS = 50_000  # new objects after which cycles are searched: at 700 that is a tenth of importing libraries


def run() -> NoReturn:
    """The command line as a process of its own."""
    gc.set_threshold(_OBJECTS)
    _open_streams()
    plain_warnings()
    try:
        main()
    except SystemExit as done:
        _leave(done.code if isinstance(done.code, int) else int(done.code is not None))
    _leave(0)


def _open_streams() -> None:
    """Let what was closed by the caller lead nowhere: else the next file that is opened takes its number, and what
    libraries write to stderr goes into it."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.dup2(os.open(os.devnull, os.O_RDWR), number)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115 - as long as the process


def _leave(code: int) -> NoReturn:
    """End the process as ``sys.exit`` does, but for taking apart all that was imported: .3 s of a clip's 1.5.

    Threads are waited for, what was registered to run at the end runs, and what was printed is written.
    """
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:  # as it is where it was closed from the start
                stream.flush()
        except (OSError, ValueError):  # whoever read it is gone, or the disk is full
            code = code or 120  # as Python itself has it
    os._exit(code)


if __name__ == "__main__":
    run()
