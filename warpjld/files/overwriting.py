"""Check, before anything is computed, that outputs overwrite no inputs and can be where they should be."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.names import clash

__all__ = ["check_outputs", "check_place"]


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Check that outputs overwrite neither inputs nor each other, and that nothing is in their way.

    Args:
        outputs: Files to write.
        inputs: Files to read; links are resolved.

    Raises:
        InputError: An output is also an input, or occurs twice; a folder or a file is in its way, or its folder cannot
            be written into.
    """
    outputs = list(outputs)
    read = {_place(path): path for path in inputs}
    for path in outputs:
        if _place(path) in read:
            raise InputError(f"is read ({read[_place(path)]}): it is not written over", path=path)
    twice = clash(_place(path) for path in outputs)
    if twice:
        told = f"as {Path(twice[0]).name} and {Path(twice[1]).name}"
        alike = "" if twice[0] == twice[1] else f" ({told}: not every file system tells upper case from lower)"
        raise InputError(f"would be written twice{alike}", path=next(p for p in outputs if _place(p) == twice[1]))
    for path in outputs:
        check_place(path)


def check_place(path: Path) -> None:
    """Check that a file can be written at a place, whose folder need not exist yet.

    Raises:
        InputError: A folder or a file is in the way, or the folder cannot be written into.
    """
    if path.is_dir():
        raise InputError("a folder stands where this file should go", path=path)
    there = next(parent for parent in (*path.parents, Path()) if os.path.lexists(parent))
    if not there.is_dir():
        raise InputError("is a file; want a folder to write into", path=there)
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError("cannot write into this folder: permission denied", path=there)


def _place(path: Path) -> str:
    return os.path.normcase(os.path.realpath(path))
