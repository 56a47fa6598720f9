"""End of a file for meshio's readers: some read on for ever after the last line of a file that was cut off."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

__all__ = ["stop_at_end"]

_EMPTY = 1000  # reads at the end of a file after which its reader does not notice; those that do need one or two


@cache  # a process reads many files: once is enough, and each time would wrap what is wrapped
def stop_at_end() -> None:
    """Make all readers of meshio in this process fail with ``EOFError`` when they read on behind the end of a file."""
    import meshio

    original = meshio._files.open_file

    @contextmanager
    def opened(given: Any, mode: str = "r") -> Iterator[Any]:
        with original(given, mode) as file:
            yield _Ending(file) if "r" in mode else file

    for name, module in list(sys.modules.items()):
        if name.startswith("meshio.") and getattr(module, "open_file", None) is original:
            module.open_file = opened  # type: ignore[attr-defined]


class _Ending:
    """A file that ends: everything else is the file's."""

    def __init__(self, file: Any) -> None:
        self._file, self._empty = file, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __iter__(self) -> Any:
        return iter(self._file)

    def __next__(self) -> Any:
        return next(self._file)

    def readline(self, *size: int) -> Any:
        return self._noticed(self._file.readline(*size))

    def read(self, *size: int) -> Any:
        return self._noticed(self._file.read(*size))

    def _noticed(self, got: Any) -> Any:
        self._empty = 0 if got else self._empty + 1
        if self._empty > _EMPTY:
            raise EOFError("the file ends before its data do")
        return got
