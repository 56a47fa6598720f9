"""Different names for things that a file calls alike."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["unique_names"]


def unique_names(names: Sequence[str]) -> list[str]:
    """Names of which the second of a kind is called ``name#2``."""
    out: list[str] = []
    for name in names:
        chosen, number = name, 1
        while chosen in out:
            number += 1
            chosen = f"{name}#{number}"
        out.append(chosen)
    return out
