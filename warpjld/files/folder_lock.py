"""One process at a time in a folder."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["locked_folder"]


@contextmanager
def locked_folder(folder: Path, file: str) -> Iterator[None]:
    """Keep other processes out of a folder while the statement lasts.

    The system drops the lock when its process ends, however it ends: none is left behind. Folders of file systems
    that know no locks are not locked.

    Args:
        folder: The folder.
        file: Name of the file in it that is locked; it stays.

    Raises:
        InputError: Another process works in the folder.
        OSError: The file cannot be made.
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
