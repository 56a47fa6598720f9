"""Checks of output destinations before anything is computed: existing folders, permissions, free space."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.overwriting import check_place

__all__ = ["check_destinations"]


def check_destinations(folder: Path, names: Iterable[str], size: float = 0.0) -> None:
    """Check that files can be written into a folder, which need not exist yet.

    Args:
        folder: The folder.
        names: Files, relative to it.
        size: Estimated size of all files [bytes].

    Raises:
        InputError: A folder or a file is in the way, the folder cannot be written into, or the disk has less room.
    """
    for name in names:
        check_place(folder / name)
    there = next(parent for parent in (folder, *folder.parents, Path()) if parent.is_dir())
    free = shutil.disk_usage(there).free
    if size > free:
        raise InputError(f"about {_stated(size)} are to be written, {_stated(free)} are free", path=there)


def _stated(size: float) -> str:
    """A number of bytes with its unit."""
    return f"{size / 1e6:,.0f} MB" if size >= 1e7 else f"{size / 1e3:,.0f} kB"
