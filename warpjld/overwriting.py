"""Refusing to write over what is read."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["check_outputs"]


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Make sure that files can be written without losing what they are made of, or one another.

    Args:
        outputs: Files to write, each once.
        inputs: Files that are read, also by links.

    Raises:
        InputError: One of them is read too, or is to be written twice.
    """
    outputs = list(outputs)
    read = {_place(path): path for path in inputs}
    for path in outputs:
        if _place(path) in read:
            raise InputError(f"is read ({read[_place(path)]}): it is not written over", path=path)
    twice = [place for place, count in Counter(map(_place, outputs)).items() if count > 1]
    if twice:
        raise InputError("would be written twice", path=next(p for p in outputs if _place(p) == twice[0]))


def _place(path: Path) -> str:
    return os.path.normcase(os.path.realpath(path))
