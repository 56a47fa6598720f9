"""Names that become files or labels, checked before any work."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["check_name", "clash", "expanded", "folded"]

_LONGEST = 180
"""Bytes of a name in UTF-8: file systems take 255, of which an actor's or a step's name and a suffix need some."""
_SIGNS = '/\\<>:"|?*$'
"""What some file system takes for something else than a letter, and what begins a formula in labels of plots."""


def check_name(name: str, what: str) -> str:
    """The name, if every file system takes it as the name of a file.

    Args:
        name: Without folders.
        what: Called so in messages.

    Raises:
        InputError: It is empty, too long, no Unicode, or holds a sign that is no part of a name.
    """
    problem = ""
    try:
        size = len(name.encode("utf-8"))
    except UnicodeEncodeError:  # bytes of a file name that are no UTF-8
        raise InputError(f"{what} {name!r:.60}: want Unicode text") from None
    strange = next((sign for sign in name if sign in _SIGNS or not sign.isprintable()), None)
    if not name.strip(" .") or name != name.strip():
        problem = "want a name that is not empty, and neither begins nor ends with a blank"
    elif strange is not None:
        problem = f"{strange!r} cannot stand in the name of a file"
    elif size > _LONGEST:
        problem = f"{size} bytes long; at most {_LONGEST}"
    if problem:
        raise InputError(f"{what} {name!r:.60}: {problem}")
    return name


def folded(name: str | Path) -> str:
    """A name as file systems compare it that tell neither case nor ways of writing an accent apart."""
    return unicodedata.normalize("NFC", str(name)).casefold()


def clash(names: Iterable[str]) -> tuple[str, str] | None:
    """The first two names that are one file where case is not told apart."""
    seen: dict[str, str] = {}
    for name in names:
        key = folded(name)
        if key in seen:
            return seen[key], name
        seen[key] = name
    return None


def expanded(name: str) -> Path:
    """A path with ``~`` and ``~user`` put in; of a user that is not known it stays as it is."""
    return Path(os.path.expanduser(name))
