"""Cache files in the user's cache folder, with removal of the least recently used ones.

The content can always be computed again, so failure to write the folder is not an error.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable
from pathlib import Path

from warpjld.files.whole_file import whole_file

__all__ = ["CACHE_VARIABLE", "keep", "kept_folder", "used"]

CACHE_VARIABLE = "WARPJLD_CACHE"
"""Environment variable with the cache folder of rigs, bindings and hands, or ``off``."""

_MOST = 128  # largest number of files
_MOST_BYTES = 2**30  # largest total size


def kept_folder() -> Path | None:
    """Cache folder; None if caching is off."""
    stated = os.environ.get(CACHE_VARIABLE)
    if stated is not None:
        return None if stated.strip().lower() in ("", "0", "off", "no") else Path(stated)
    try:
        home = Path.home()
    except RuntimeError:
        return None
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", home / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")
    return base / "warpjld" / "kept"


def keep(file: Path, write: Callable[[Path], None]) -> None:
    """Write a cache file by ``write``, if the folder can be written, and remove the least recently used files."""
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as part:
            write(part)
        _tidy(file.parent)


def used(file: Path) -> None:
    """Mark a cache file as used now."""
    with contextlib.suppress(OSError):
        os.utime(file)


def _tidy(folder: Path) -> None:
    known = []
    for file in folder.glob("*.npz"):
        try:
            known.append((file.stat().st_mtime, file.stat().st_size, file))
        except FileNotFoundError:  # removed by another process
            continue
    size = 0
    for place, (_, its, file) in enumerate(sorted(known, key=lambda one: one[0], reverse=True)):
        size += its
        if place >= _MOST or (place and size > _MOST_BYTES):
            file.unlink(missing_ok=True)
