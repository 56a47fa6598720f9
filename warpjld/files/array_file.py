"""NumPy array files, read without pickled Python objects, since unpickling runs code."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.archive import check_archive
from warpjld.files.input_file import check_input
from warpjld.files.reading import reading
from warpjld.limits import check_limit

__all__ = ["read_arrays"]


def read_arrays(path: str | Path) -> dict[str, NDArray[Any]]:
    """Arrays of an ``.npz`` file by name; the array of an ``.npy`` file has the name "".

    Raises:
        InputError: The file cannot be read, is not a NumPy file, has pickled objects, or exceeds ``unpacked-bytes``.
    """
    path = Path(path)
    check_input(path)
    try:
        with reading(path, "a NumPy file of arrays", but=(ValueError, RuntimeError)):
            return _arrays(path)
    except (ValueError, RuntimeError) as error:
        if "pickle" in str(error).lower() or "object" in str(error).lower():
            raise InputError(
                "contains pickled Python objects, which may run any code, and is not read; save plain arrays",
                path=path,
            ) from None
        raise InputError(f"is not a NumPy file of arrays ({error})", path=path) from None


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    if path.suffix.lower() == ".npy":
        check_limit("unpacked-bytes", path.stat().st_size, path=path)
        # memory-mapped, so that a header that announces more data than the file has does not allocate it
        return {"": np.array(np.load(path, mmap_mode="r", allow_pickle=False))}
    arrays = {}
    check_archive(path, "archive of NumPy arrays (.npz)")
    with zipfile.ZipFile(path) as file:
        for member in file.infolist():
            if member.filename.endswith(".npy"):
                arrays[member.filename[:-4]] = _member(file, member)
    return arrays


def _member(file: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    with file.open(member) as stream:
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, kind = read(stream)
        if kind.hasobject:
            raise ValueError("pickled objects")
        if int(np.prod([int(n) for n in shape], dtype=object)) * kind.itemsize > member.file_size:
            raise ValueError(f"'{member.filename}' is shorter than its header states")
    with file.open(member) as stream:
        array: NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    return array
