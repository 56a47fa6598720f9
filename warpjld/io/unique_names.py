"""Unique names for objects with duplicate names in a file."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["unique_names"]


def unique_names(names: Sequence[str]) -> list[str]:
    """The names, with ``#2`` and so on appended to repeated ones."""
    out: dict[str, None] = {}
    last: dict[str, int] = {}
    for name in names:
        chosen = name
        while chosen in out:
            last[name] = last.get(name, 1) + 1
            chosen = f"{name}#{last[name]}"
        out[chosen] = None
    return list(out)
