"""Table of digits whose closing was limited, with a row per digit and frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["LimitedDigit", "LimitedDigits"]


@dataclass(frozen=True)
class LimitedDigit:
    """A digit that was closed less than posed in one frame.

    Attributes:
        digit: Name, e.g. ``left.index``.
        frame: Frame number.
        depth: Penetration depth in the original pose [m].
        share: Share of its joints' rotation from rest that is kept, 0…1.
        flexion: Sum of its joints' flexion at which it touches [degrees].
        other: Part it penetrates in the original pose; empty where its faces only crossed.
        crosses: Whether it still crosses another part, however far it opens.
    """

    digit: str
    frame: int
    depth: float
    share: float
    flexion: float
    other: str
    crosses: bool


_ROW = np.dtype(
    {
        "names": ["digit", "frame", "depth", "share", "flexion", "other", "crosses"],
        "formats": ["i2", "i8", "f8", "f8", "f8", "i4", "?"],
    }
)


class LimitedDigits(Sequence[LimitedDigit]):
    """Limited digits of all frames, stored in one structured array.

    Args:
        digits: Names of the digits.
        parts: Names of the parts that they can penetrate.
    """

    def __init__(self, digits: Sequence[str], parts: Sequence[str]) -> None:
        self._digits, self._parts = tuple(digits), tuple(parts)
        self._blocks: list[NDArray[Any]] = [np.zeros(0, _ROW)]

    def add(self, digit: int, frames: NDArray[np.int64], **values: NDArray[Any]) -> None:
        """Add frames (n,) of a digit, with columns (n,) by name; ``other`` is the index of a part, -1 for none."""
        rows = np.zeros(len(frames), _ROW)
        rows["digit"], rows["frame"] = digit, frames
        for name, column in values.items():
            rows[name] = column
        self._blocks.append(rows)

    def add_all(self, others: LimitedDigits) -> None:
        """Add another table of the same digits; later rows replace earlier ones of the same digit and frame."""
        self._blocks.append(others.rows)

    @property
    def rows(self) -> NDArray[Any]:
        """All rows, sorted by digit and frame."""
        if len(self._blocks) > 1:
            rows = np.concatenate(self._blocks)
            rows = rows[np.lexsort((rows["frame"], rows["digit"]))]
            again = (rows["digit"][1:] == rows["digit"][:-1]) & (rows["frame"][1:] == rows["frame"][:-1])
            self._blocks = [rows[np.append(~again, True)[: len(rows)]]]
        return self._blocks[0]

    def by_digit(self) -> dict[str, NDArray[Any]]:
        """Rows of each limited digit, by its name."""
        rows = self.rows
        return {self._digits[n]: rows[rows["digit"] == n] for n in np.unique(rows["digit"]).tolist()}

    def record(self, row: Any) -> LimitedDigit:
        """Record of a row of the structured array."""
        other = self._parts[int(row["other"])] if row["other"] >= 0 else ""
        depth, share, flexion = (float(row[name]) for name in ("depth", "share", "flexion"))
        digit, frame, crosses = self._digits[int(row["digit"])], int(row["frame"]), bool(row["crosses"])
        return LimitedDigit(digit, frame, depth, share, flexion, other, crosses)

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self.record(row) for row in self.rows[index]]
        return self.record(self.rows[index])
