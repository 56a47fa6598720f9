"""Append-only table of float64 rows, kept in memory up to some megabytes and then in a temporary file."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from threading import Lock

import numpy as np
from numpy.typing import NDArray

__all__ = ["SpilledRows"]

_IN_MEMORY = 8 << 20  # bytes
_BLOCK = 1024  # rows read at once


class SpilledRows:
    """Rows of float64 numbers that are appended, and read by slices.

    Args:
        width: Count of numbers in a row.
    """

    def __init__(self, width: int) -> None:
        self._width = width
        self._count = 0
        self._file = tempfile.SpooledTemporaryFile(max_size=_IN_MEMORY)  # noqa: SIM115, closed with the last reference
        self._lock = Lock()

    def __len__(self) -> int:
        return self._count

    def extend_from(self, path: str | Path) -> None:
        """Append rows from a binary file: contiguous float64 in native byte order."""
        with Path(path).open("rb") as rows:
            row = 8 * max(self._width, 1)
            while data := rows.read(max(_IN_MEMORY // row, 1) * row):
                self.extend(np.frombuffer(data, dtype=np.float64).reshape(-1, self._width))

    def extend(self, rows: NDArray[np.float64]) -> None:
        """Append rows, shape (n, width)."""
        with self._lock:
            self._file.seek(0, 2)
            self._file.write(np.ascontiguousarray(rows, dtype=np.float64).tobytes())
            self._count += len(rows)

    def __getitem__(self, rows: slice) -> NDArray[np.float64]:
        """Consecutive rows as a new array, shape (n, width)."""
        start, stop, _ = rows.indices(self._count)
        size, count = 8 * self._width, max(stop - start, 0)
        with self._lock:
            self._file.seek(start * size)
            data = self._file.read(count * size)
        return np.frombuffer(data, dtype=np.float64).reshape(count, self._width).copy()

    def blocks(self) -> Iterator[NDArray[np.float64]]:
        """All rows, in blocks of at most 1024."""
        for start in range(0, self._count, _BLOCK):
            yield self[start : start + _BLOCK]
