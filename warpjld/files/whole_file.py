"""Files that are there whole or not at all."""

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
    """A short mark of this machine, for the names of temporary files: numbers of processes mean nothing on others."""
    return f"{zlib.crc32(platform.node().encode()):08x}"


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A place to write to that becomes ``path`` when the statement ends, and is removed where that fails.

    It lies beside and has the same suffix, see ``part_of``. Several processes may write the same file: each writes a
    whole one, and the last one stays. What processes that were killed left in the folder is removed.
    """
    sweep(path.parent)
    part = part_of(path)
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """Temporary place beside a file, of this process alone: ``out/.table.part123-5c0f1d22.csv`` for ``out/table.csv``
    in process 123 of this machine."""
    return path.with_name(f".{path.stem}.part{os.getpid()}-{machine()}{path.suffix}")


def sweep(folder: Path) -> None:
    """Remove temporary files of this machine's processes that run no more, once a process and folder."""
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
    """Whether a process of that number runs on this machine; True where that cannot be told."""
    if os.name != "posix" or process == os.getpid():
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
