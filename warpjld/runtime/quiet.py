"""Initialisation of Warp without its messages, for command-line programs."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile

__all__ = ["silence_warp"]


def silence_warp() -> None:
    """Initialise Warp without its greeting on stdout and its native library's message on stderr about a missing GPU; if
    a GPU is requested, an error reports that."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    if sys.stderr is not None:
        sys.stderr.flush()
    try:
        kept = os.dup(2)
    except OSError:  # stderr is closed
        warp.init()
        return
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        moved = _initialised()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
    if moved is not None and sys.stderr is not None:
        print(f"warning: {moved}", file=sys.stderr)


def _initialised() -> str | None:
    """Initialise Warp, with a temporary kernel cache if the usual one is not writable; returns a warning then."""
    import warp

    problem = ""
    try:
        warp.init()
        folder = warp.config.kernel_cache_dir
        if os.access(folder, os.W_OK | os.X_OK):
            return None
        problem = f"{folder}: permission denied"
    except OSError as error:
        problem = f"{error.filename or 'the cache'}: {error.strerror or error}"
    folder = tempfile.mkdtemp(prefix="warpjld-kernels-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["WARP_CACHE_PATH"] = folder  # for child processes
    warp.config.kernel_cache_dir = folder
    warp.init()
    return f"kernels cannot be kept ({problem}): they are compiled anew; WARP_CACHE_PATH names another folder"
