"""Check that outputs do not overwrite inputs."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.names import clash

__all__ = ["check_outputs"]


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Check that outputs overwrite neither inputs nor each other.

    Args:
        outputs: Files to write.
        inputs: Files to read; links are resolved.

    Raises:
        InputError: An output is also an input, or occurs twice.
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


def _place(path: Path) -> str:
    return os.path.normcase(os.path.realpath(path))
