"""Schema of a table of results: columns with type, unit and description, and validation of values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from warpjld.errors import WarpjldError

__all__ = ["Column", "checked_values"]

Kind = Literal["integer", "number", "truth", "text"]

_PYTHON: dict[Kind, tuple[type, ...]] = {"integer": (int,), "number": (float, int), "truth": (bool,), "text": (str,)}


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        name: Name in the file, lower case with underscores.
        kind: "integer" (int64), "number" (float64), "truth" (bool) or "text" (string). Any value may be missing.
        unit: SI unit, "" for dimensionless numbers and text.
        about: Description, with the frame of reference where there is one.
    """

    name: str
    kind: Kind
    unit: str
    about: str


def checked_values(values: Mapping[str, Any], columns: Sequence[Column]) -> dict[str, Any]:
    """Values in the columns' order and Python types, missing ones and NaN as None.

    Raises:
        WarpjldError: A value without a column, or of another type than its column: an error in the program.
    """
    stray = set(values) - {column.name for column in columns}
    if stray:
        raise WarpjldError(f"trial: no column for {', '.join(sorted(stray))}")
    return {column.name: _checked(values.get(column.name), column) for column in columns}


def _checked(value: Any, column: Column) -> Any:
    """A value as the Python type of its column; None where it is missing or NaN."""
    if value is None:
        return None
    plain: Any = value.item() if hasattr(value, "item") else value
    if type(plain) not in _PYTHON[column.kind]:
        raise WarpjldError(f"trial: column '{column.name}' holds {column.kind}, got {plain!r}")
    if column.kind == "number":
        number = float(plain)
        return None if math.isnan(number) else number
    return plain
