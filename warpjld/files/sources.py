"""Hash of the package's source code, so that cached values are used only by the code that made them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

__all__ = ["hash_of_sources", "source_files"]


def source_files(patterns: tuple[str, ...]) -> Iterator[tuple[str, Path]]:
    """Names and paths of the package's modules that match glob patterns, and of all kernels, in a fixed order."""
    import warpjld_kernels

    import warpjld

    package, kernels = Path(warpjld.__path__[0]), Path(warpjld_kernels.__path__[0])
    for folder, wanted in ((package, patterns), (kernels, ("*.py",))):
        for file in sorted({file for pattern in wanted for file in folder.glob(pattern)}):
            yield f"{folder.name}/{file.relative_to(folder).as_posix()}", file


@cache
def hash_of_sources(patterns: tuple[str, ...]) -> str:
    """Hash of the content of source files; version numbers, times and sizes do not identify code under development."""
    digest = hashlib.sha256()
    for name, file in source_files(patterns):
        digest.update(name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()
