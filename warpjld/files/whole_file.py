"""Atomic writing of files: a file is complete or does not exist."""

from __future__ import annotations

import contextlib
import os
import platform
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["machine", "part_of", "process_runs", "sweep", "whole_file"]

_swept: set[str] = set()


def machine() -> str:
    """Short identifier of this machine for names of temporary files, since process ids are only unique per machine."""
    return f"{zlib.crc32(platform.node().encode()):08x}"


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Context with a temporary file, which is renamed to ``path`` at the end, or removed after an exception.

    It is in the same folder and has the same suffix, see ``part_of``. Several processes may write the same file: the
    last complete one remains. Temporary files left in the folder by killed processes are removed.
    """
    sweep(path.parent)
    part = part_of(path)
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """Temporary path next to a file, unique to this process: ``out/.table.part123-5c0f1d22.csv`` for ``out/table.csv``
    in process 123 of this machine."""
    return path.with_name(f".{path.stem}.part{os.getpid()}-{machine()}{path.suffix}")


def sweep(folder: Path) -> None:
    """Remove temporary files of processes of this machine that have ended; once per process and folder."""
    place = os.path.abspath(folder)
    if place in _swept:
        return
    _swept.add(place)
    part = re.compile(rf"\..+\.part([0-9]+)-{machine()}(\.[^.]*)?")
    with contextlib.suppress(OSError):
        for entry in os.scandir(place):
            found = part.fullmatch(entry.name)
            if found and not process_runs(int(found[1])):
                with contextlib.suppress(OSError):
                    os.unlink(entry.path)


def process_runs(process: int) -> bool:
    """Whether a process with this id runs on this machine; True if that cannot be determined."""
    if os.name != "posix" or process == os.getpid():
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
