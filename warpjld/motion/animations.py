"""Names of the animations in a file."""

from __future__ import annotations

from pathlib import Path

__all__ = ["animation_names"]


def animation_names(path: str | Path) -> tuple[str, ...]:
    """Names of a file's animations, in its order; empty for files that hold one motion without a name."""
    return ()
