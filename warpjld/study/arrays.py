"""Collects rows and arrays of a study from its trials on disk; the files are the same, byte for byte, in any run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import WarpjldError
from warpjld.files.whole_file import whole_file
from warpjld.study.shards import Shard

__all__ = ["gathered", "write_arrays"]


def gathered(shards: Iterable[Shard]) -> tuple[list[dict[str, Any]], dict[str, NDArray[Any]]]:
    """Collect the trials.

    Returns:
        Rows in trial order; and for every array name the arrays of all trials that have it, stacked, with the numbers
        of these trials as ``NAME.trials``.

    Raises:
        WarpjldError: Arrays of one name with different shapes or types.
    """
    rows: list[dict[str, Any]] = []
    stacks: dict[str, list[NDArray[Any]]] = {}
    owners: dict[str, list[int]] = {}
    for shard in shards:
        rows.append(shard.row)
        for name, array in shard.arrays.items():
            stack = stacks.setdefault(name, [])
            if stack and (stack[0].shape != array.shape or stack[0].dtype != array.dtype):
                shapes = f"{array.shape} in trial {shard.trial}, {stack[0].shape} before"
                raise WarpjldError(f"array '{name}' has two shapes or types: {shapes}")
            stack.append(array)
            owners.setdefault(name, []).append(shard.trial)
    arrays: dict[str, NDArray[Any]] = {}
    for name in sorted(stacks):
        arrays[name] = np.stack(stacks[name])
        arrays[f"{name}.trials"] = np.array(owners[name], dtype=np.int64)
    return rows, arrays


def write_arrays(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write a NumPy archive (npz)."""
    assert not any(array.dtype.hasobject for array in arrays.values())
    with whole_file(path) as part, part.open("wb") as file:
        # numpy sets the date of the archive's members to 1980, so the bytes do not depend on the clock
        # numpy 2.0 has no argument allow_pickle here, and would store it as another array
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
