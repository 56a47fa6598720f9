"""Tables in Parquet or CSV files with described columns, without time stamps: equal rows give equal bytes."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from warpjld.errors import MissingExtraError
from warpjld.files.whole_file import whole_file
from warpjld.tables.columns import Column

__all__ = ["read_table", "require_parquet", "write_parquet", "write_table_csv"]

_PURPOSE = "a Parquet table"


def require_parquet() -> None:
    """Raise MissingExtraError where pyarrow is not installed; called before a study begins."""
    try:
        import pyarrow  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(_PURPOSE, "study") from error


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


def write_table_csv(
    path: Path, rows: Sequence[dict[str, Any]], columns: Sequence[Column], *, described: str = "columns.json"
) -> None:
    """Write a CSV file (UTF-8, one header line, missing values empty), and a JSON file of its columns beside it.

    Args:
        path: The CSV file.
        rows: Values by column.
        columns: The columns, in order.
        described: Name of the JSON file.
    """
    with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([c.name for c in columns])
        for row in rows:
            writer.writerow([_cell(row[c.name]) for c in columns])
    about = [{"name": c.name, "type": c.kind, "unit": c.unit, "description": c.about} for c in columns]
    with whole_file(path.with_name(described)) as part:
        part.write_text(json.dumps(about, indent=1, ensure_ascii=False) + "\n", "utf-8")


def read_table(path: Path) -> list[dict[str, Any]]:
    """Read the rows of a table that :func:`write_parquet` wrote.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    require_parquet()
    import pyarrow.parquet as pq

    rows: list[dict[str, Any]] = pq.read_table(path).to_pylist()
    return rows


def _cell(value: Any) -> str:
    """Text of a value in a CSV file."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)
