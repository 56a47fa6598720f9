"""Validation of names that are used as file names or labels."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from warpjld.errors import InputError

__all__ = ["check_name", "clash", "expanded", "folded"]

_LONGEST = 180
"""Longest name in UTF-8 [bytes]: file systems allow 255, part of which a prefix and a suffix need."""
_SIGNS = '/\\<>:"|?*$'
"""Characters that are special to some file system, and ``$``, which begins a formula in plot labels."""


def check_name(name: str, what: str) -> str:
    """Return the name if it is a valid file name on all file systems.

    Args:
        name: Name without folders.
        what: Description of the name, for messages.

    Raises:
        InputError: The name is empty, too long, not Unicode, or has an invalid character.
    """
    problem = ""
    try:
        size = len(name.encode("utf-8"))
    except UnicodeEncodeError:  # file name with bytes that are not UTF-8
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
    """Name as compared by file systems that ignore case and Unicode normalisation."""
    return unicodedata.normalize("NFC", str(name)).casefold()


def clash(names: Iterable[str]) -> tuple[str, str] | None:
    """First two names that are the same file on file systems that ignore case; None if there are none."""
    seen: dict[str, str] = {}
    for name in names:
        key = folded(name)
        if key in seen:
            return seen[key], name
        seen[key] = name
    return None


def expanded(name: str) -> Path:
    """Path with ``~`` and ``~user`` expanded; unchanged if the user is unknown."""
    return Path(os.path.expanduser(name))
