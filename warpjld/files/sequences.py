"""Removal of stale frames of numbered file sequences, which tools would read as part of the new sequence."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterable
from pathlib import Path

__all__ = ["remove_former"]

_KINDS = tuple(
    re.compile(kind, re.IGNORECASE)
    for kind in (
        r"(?P<stem>.+\.)(?P<number>-?[0-9]{4,})(?P<suffix>\.obj)",
        r"(?P<stem>.+_)(?P<number>[0-9]{4,})(?P<suffix>\.vtu)",
    )
)


def remove_former(files: Iterable[Path]) -> None:
    """Remove other files that belong to the same numbered sequences.

    Args:
        files: All files of the new sequences.
    """
    written: dict[Path, set[str]] = {}
    wanted: dict[Path, set[tuple[str, str]]] = {}
    for file in files:
        key = _sequence(file.name)
        if key is not None:
            written.setdefault(file.parent, set()).add(file.name)
            wanted.setdefault(file.parent, set()).add(key)
    for folder, keys in wanted.items():
        for place in folder.iterdir():
            if place.name not in written[folder] and _sequence(place.name) in keys:
                with contextlib.suppress(OSError):
                    place.unlink()


def _sequence(name: str) -> tuple[str, str] | None:
    """Prefix and suffix shared by the names of a sequence; None for a name without a number."""
    for kind in _KINDS:
        if found := kind.fullmatch(name):
            return found["stem"].lower(), found["suffix"].lower()
    return None
