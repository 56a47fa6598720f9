"""The program's own files: what is kept from one process to the next counts for the programs that made it alone."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

__all__ = ["hash_of_sources", "source_files"]


def source_files(patterns: tuple[str, ...]) -> Iterator[tuple[str, Path]]:
    """Names and places of modules of the package, by glob patterns, and of all kernels, always in the same order."""
    import warpjld_kernels

    import warpjld

    package, kernels = Path(warpjld.__path__[0]), Path(warpjld_kernels.__path__[0])
    for folder, wanted in ((package, patterns), (kernels, ("*.py",))):
        for file in sorted({file for pattern in wanted for file in folder.glob(pattern)}):
            yield f"{folder.name}/{file.relative_to(folder).as_posix()}", file


@cache
def hash_of_sources(patterns: tuple[str, ...]) -> str:
    """Of their content: a version under way changes without its number, and times and sizes of files say too little."""
    digest = hashlib.sha256()
    for name, file in source_files(patterns):
        digest.update(name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()
