"""Calls of meshio in a process of its own: some of its readers never end on files that were cut off."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path

from warpjld.runtime.separate import Answer, separately

__all__ = ["with_meshio"]

_PER_BYTE = 50
"""Memory for each byte of a file: the words of a text as Python strings are five times its size."""
_SECONDS_PER_BYTE = 1e-6  # meshio reads some megabytes of text a second


def with_meshio(place: tuple[str, str], path: Path, kind: str, *arguments: object) -> AbstractContextManager[Answer]:
    """As :func:`~warpjld.runtime.separate.separately`, with meshio's limits.

    Raises:
        InputError: As the function does; or meshio crashed, needed too much memory, or did not end in time.
    """
    return separately(
        place,
        path,
        kind,
        *arguments,
        per_byte=_PER_BYTE,
        within="mesh-seconds",
        seconds_per_byte=_SECONDS_PER_BYTE,
    )
