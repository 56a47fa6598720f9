"""Rows and arrays of a study from its trials on disk, in their order: the same bytes however it was run."""

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
    """Rows in trial order, and per array name the trials that have it stacked, with their numbers as ``NAME.trials``.

    Raises:
        WarpjldError: One name with two shapes.
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
        # numpy dates the archive's members 1980, so bytes do not depend on the clock
        # numpy 2.0 knows no allow_pickle here, and would store it as one array more
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
