"""Different names for things that a file calls alike."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["unique_names"]


def unique_names(names: Sequence[str]) -> list[str]:
    """Names of which the second of a kind is called ``name#2``."""
    out: dict[str, None] = {}
    last: dict[str, int] = {}
    for name in names:
        chosen = name
        while chosen in out:
            last[name] = last.get(name, 1) + 1
            chosen = f"{name}#{last[name]}"
        out[chosen] = None
    return list(out)
