"""Exclusive lock of a folder, held by one process at a time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["locked_folder"]


@contextmanager
def locked_folder(folder: Path, file: str) -> Iterator[None]:
    """Context in which this process holds an exclusive lock of a folder.

    The operating system releases the lock when the process ends for any reason. Folders on file systems without locks
    are not locked.

    Args:
        folder: The folder.
        file: Name of the lock file in it, which is not removed.

    Raises:
        InputError: Another process holds the lock.
        OSError: The lock file cannot be created.
    """
    with (folder / file).open("a+b") as handle:
        try:
            _lock(handle.fileno())
        except (BlockingIOError, PermissionError):
            raise InputError("another process is working in this folder", path=folder) from None
        except OSError:
            pass
        yield


if sys.platform == "win32":

    def _lock(descriptor: int) -> None:
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:

    def _lock(descriptor: int) -> None:
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
