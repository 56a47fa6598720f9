"""Writer of NumPy archives (``.npz``) whose arrays may be larger than memory: they are appended piece by piece."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np
from numpy.lib import format as npy
from numpy.typing import ArrayLike, DTypeLike, NDArray

from warpjld.errors import WarpjldError

__all__ = ["ArrayArchive"]


class ArrayArchive:
    """An archive that is being written, one array after the other; ``np.load`` reads it.

    Used in a ``with`` statement, or ended by ``close`` or ``discard``. Members are not compressed and carry no time, so
    that equal arrays give equal bytes.

    Args:
        path: The file, which is created; callers write to a temporary one (see ``whole_file``).

    Raises:
        OSError: The file cannot be written; so do all methods.
    """

    def __init__(self, path: Path) -> None:
        self._zip: zipfile.ZipFile | None = zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, allowZip64=True)
        self._member: IO[bytes] | None = None
        self._name, self._left = "", 0

    def add(self, name: str, array: ArrayLike) -> None:
        """Append an array as a whole."""
        whole = np.ascontiguousarray(array)
        self.begin(name, np.shape(array), whole.dtype)
        self.extend(whole)

    def begin(self, name: str, shape: Sequence[int], dtype: DTypeLike) -> None:
        """Begin an array, whose rows are given to ``extend``; the one before must be complete."""
        self._end()
        kind: np.dtype[Any] = np.dtype(dtype)
        self._name, self._left = name, int(np.prod(shape, dtype=np.int64)) * kind.itemsize
        assert self._zip is not None
        self._member = self._zip.open(f"{name}.npy", "w", force_zip64=True)
        header = {"descr": npy.dtype_to_descr(kind), "fortran_order": False, "shape": tuple(shape)}
        npy.write_array_header_1_0(self._member, header)

    def extend(self, rows: NDArray[Any]) -> None:
        """Append rows of the array that was begun: contiguous, of its type."""
        assert self._member is not None
        self._left -= rows.nbytes
        self._member.write(rows.data if rows.size else b"")

    def _end(self) -> None:
        member, self._member = self._member, None
        if member is not None:
            member.close()
        if self._left:
            raise WarpjldError(f"'{self._name}': {abs(self._left)} bytes too {'few' if self._left > 0 else 'many'}")

    def close(self) -> None:
        """Complete the archive and close the file.

        Raises:
            WarpjldError: An array was not completed.
        """
        if self._zip is not None:
            self._end()
            self._zip.close()
            self._zip = None

    def discard(self) -> None:
        """Close the file without completing it; nothing after ``close``, or if it is closed already."""
        archive, self._zip = self._zip, None
        member, self._member = self._member, None
        if archive is None:
            return
        with contextlib.suppress(OSError):  # of a full disk
            if member is not None:
                member.close()
        # the archive's own close would write its directory, and once more when it is deleted
        file, archive.fp = archive.fp, None
        with contextlib.suppress(OSError):
            if file is not None:
                file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self.close()
        finally:
            self.discard()
