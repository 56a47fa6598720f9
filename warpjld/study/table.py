"""The results table (Parquet or CSV) and the arrays beside it (npz), from the trials kept on disk.

All three hold results only, in the order of the trials: a study gives the same bytes however it was run.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import MissingExtraError, WarpjldError
from warpjld.study.columns import Column
from warpjld.study.shards import Shard
from warpjld.whole_file import whole_file

__all__ = ["gathered", "read_table", "require_parquet", "write_arrays", "write_csv", "write_parquet"]

_PURPOSE = "a Parquet table"


def require_parquet() -> None:
    """Raise MissingExtraError where Parquet cannot be written; before a study, not after it."""
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(_PURPOSE, "study") from error


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


def write_parquet(path: Path, rows: Sequence[dict[str, Any]], columns: Sequence[Column]) -> None:
    """Write a Parquet file; every field's metadata holds its unit and description.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    require_parquet()
    import pyarrow as pa
    import pyarrow.parquet as pq

    types = {"integer": pa.int64(), "number": pa.float64(), "truth": pa.bool_(), "text": pa.string()}
    fields = [pa.field(c.name, types[c.kind], metadata={"unit": c.unit, "description": c.about}) for c in columns]
    arrays = [pa.array([row[c.name] for row in rows], type=types[c.kind]) for c in columns]
    with whole_file(path) as part:
        pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), part, compression="zstd")


def write_csv(
    path: Path, rows: Sequence[dict[str, Any]], columns: Sequence[Column], *, described: str = "columns.json"
) -> None:
    """Write a CSV file (UTF-8, one header line, missing values empty), and a JSON file beside it that describes it."""
    with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([c.name for c in columns])
        for row in rows:
            writer.writerow([_cell(row[c.name]) for c in columns])
    about = [{"name": c.name, "type": c.kind, "unit": c.unit, "description": c.about} for c in columns]
    with whole_file(path.with_name(described)) as part:
        part.write_text(json.dumps(about, indent=1, ensure_ascii=False) + "\n", "utf-8")


def write_arrays(path: Path, arrays: dict[str, NDArray[Any]]) -> None:
    """Write a NumPy archive (npz)."""
    assert not any(array.dtype.hasobject for array in arrays.values())
    with whole_file(path) as part, part.open("wb") as file:
        # numpy dates the archive's members 1980, so bytes do not depend on the clock
        # numpy 2.0 knows no allow_pickle here, and would store it as one array more
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def read_table(path: Path) -> list[dict[str, Any]]:
    """Rows of a table written here, Parquet only.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    require_parquet()
    import pyarrow.parquet as pq

    rows: list[dict[str, Any]] = pq.read_table(path).to_pylist()
    return rows


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)
