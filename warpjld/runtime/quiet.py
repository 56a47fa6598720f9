"""Initialisation of Warp without its messages, for command-line programs."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from pathlib import Path

from warpjld.runtime.kernel_cache import remove_damaged_kernels

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
        lines_written = _initialised()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
    if lines_written and sys.stderr is not None:
        for line in lines_written:
            print(f"warning: {line}", file=sys.stderr)


def _initialised() -> list[str]:
    """Initialise Warp; returns messages about its kernel cache.

    Damaged kernels are removed from the cache; if it cannot be written, a temporary one of this process is used.
    """
    import warp

    try:
        warp.init()
        folder = warp.config.kernel_cache_dir
        if os.access(folder, os.W_OK | os.X_OK):
            return _checked(Path(folder))
        problem = f"{folder}: permission denied"
    except OSError as error:
        problem = f"{error.filename or 'the cache'}: {error.strerror or error}"
    _move_cache()
    return [f"kernels cannot be kept ({problem}): they are compiled anew; WARP_CACHE_PATH names another folder"]


def _checked(cache: Path) -> list[str]:
    """Check a cache's kernels, now and when the process ends; returns messages."""
    damaged, gone = remove_damaged_kernels(cache)
    atexit.register(remove_damaged_kernels, cache)  # stores checksums of newly compiled modules
    if not damaged:
        return []
    if not gone:
        _move_cache()
    return [f"damaged kernels in {cache} ({', '.join(sorted(set(damaged)))}): they are compiled anew"]


def _move_cache() -> None:
    """Use a temporary kernel cache for this process and its child processes."""
    import warp

    folder = tempfile.mkdtemp(prefix="warpjld-kernels-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ["WARP_CACHE_PATH"] = folder  # for child processes
    warp.config.kernel_cache_dir = folder
    warp.init()
