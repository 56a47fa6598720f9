"""What is worth keeping from one process to the next, as files in the user's cache folder.

The ones longest unused go. Whatever they hold can be made again, so a folder that cannot be written is no fault.
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
"""Environment variable: the folder in which bindings and hands are kept, or ``off``."""

_MOST = 64  # files in the folder, and
_MOST_BYTES = 2**30  # all together


def kept_folder() -> Path | None:
    """Where files are kept; None where they are not."""
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
    """Keep a file that ``write`` writes, if the folder can be written, and let go of what was not used for longest."""
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as part:
            write(part)
        _tidy(file.parent)


def used(file: Path) -> None:
    """Note that a kept file is still wanted."""
    with contextlib.suppress(OSError):
        os.utime(file)


def _tidy(folder: Path) -> None:
    known = []
    for file in folder.glob("*.npz"):
        try:
            known.append((file.stat().st_mtime, file.stat().st_size, file))
        except FileNotFoundError:  # another process tidies too
            continue
    size = 0
    for place, (_, its, file) in enumerate(sorted(known, key=lambda one: one[0], reverse=True)):
        size += its
        if place >= _MOST or (place and size > _MOST_BYTES):
            file.unlink(missing_ok=True)
