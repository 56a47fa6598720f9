"""Files that are read: regular ones, and none larger than the limit."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

from warpjld.errors import InputError
from warpjld.limits import check_limit

__all__ = ["check_input", "open_input", "read_bytes"]


def open_input(path: str | Path) -> BinaryIO:
    """A file opened for reading; pipes and devices, which may never end or start something, are not.

    Raises:
        InputError: It cannot be opened, is no regular file, or is larger than the limit ``file-bytes``.
    """
    try:
        # without waiting: a pipe that nobody writes into would hold on for ever
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
    """All of a file. Raises as ``open_input``."""
    with open_input(path) as file:
        try:
            return file.read()
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", path=path) from None


def check_input(path: str | Path) -> None:
    """Make sure that a library may open a file. Raises as ``open_input``."""
    open_input(path).close()
