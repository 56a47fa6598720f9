"""Opening of input files: regular files only, not larger than the limit."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from warpjld.errors import InputError
from warpjld.limits import check_limit

__all__ = ["check_input", "open_input", "read_bytes"]


def open_input(path: str | Path) -> BinaryIO:
    """Open a regular file for reading; pipes and devices, which may block or have side effects, are refused.

    Raises:
        InputError: The file cannot be opened, is not a regular file, or is larger than the limit ``file-bytes``.
    """
    try:
        # non-blocking: opening a pipe without a writer would block for ever
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    except ValueError as error:  # a name with a zero byte
        raise InputError(f"is no name of a file: {error}", path=repr(str(path))) from None
    try:
        found = os.fstat(descriptor)
        if stat.S_ISDIR(found.st_mode):
            raise InputError("is a folder; want a file", path=path)
        if not stat.S_ISREG(found.st_mode):
            raise InputError("is no regular file (a pipe or a device): save its content in a file", path=path)
        check_limit("file-bytes", found.st_size, path=path)
    except BaseException:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def read_bytes(path: str | Path) -> bytes:
    """Content of a file; raises as ``open_input``."""
    with open_input(path) as file:
        try:
            return file.read()
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", path=path) from None


def check_input(path: str | Path) -> None:
    """Check that a library may open a file; raises as ``open_input``."""
    open_input(path).close()
