"""Storage of trials while a study runs: one JSON file per trial with a checksum, written atomically."""

from __future__ import annotations

import base64
import hashlib
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import WarpjldError
from warpjld.tables.columns import Column, checked_values

__all__ = ["Shard", "Shards"]

_DAMAGED = (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, MemoryError, RecursionError)
_A_FOLDER = 1000  # trials per folder, to avoid folders with very many files


@dataclass(frozen=True, eq=False)
class Shard:
    """One trial as stored: row of the table, arrays, and wall-clock time [s], which is not in the table."""

    trial: int
    row: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    seconds: float

    def packed(self) -> bytes:
        """Bytes of its file: a line of JSON, and one with its checksum."""
        content = {
            "trial": self.trial,
            "row": self.row,
            "arrays": {name: _packed(array) for name, array in self.arrays.items()},
            "seconds": self.seconds,
        }
        line = json.dumps(content, allow_nan=True, ensure_ascii=False).encode("utf-8")
        return line + b"\n" + _checksum(line)

    @staticmethod
    def unpacked(content: bytes) -> Shard:
        """Inverse of `packed`; damaged bytes raise one of the exceptions in ``_DAMAGED``."""
        line, _, checksum = content.rpartition(b"\n")
        if checksum != _checksum(line):
            raise ValueError("its checksum is another")
        found = json.loads(line.decode("utf-8"))
        arrays = {name: _unpacked(packed) for name, packed in found["arrays"].items()}
        return Shard(int(found["trial"]), dict(found["row"]), arrays, float(found["seconds"]))

    def results(self) -> bytes:
        """Bytes of its results without the time; these are the same wherever the trial is run."""
        return replace(self, seconds=0.0).packed()


def _checksum(line: bytes) -> bytes:
    """A changed digit would go unnoticed otherwise, and change the study's results."""
    return hashlib.blake2b(line, digest_size=16).hexdigest().encode()


class Shards:
    """Folder of trials. Numbers are stored exactly: doubles as shortest round-trip decimals, arrays as bytes.

    Args:
        folder: The folder.
        columns: Columns that a trial's row must have to be valid; empty: no check.
    """

    def __init__(self, folder: Path, columns: Sequence[Column] = ()) -> None:
        self._folder = folder
        self._columns = columns

    def path(self, trial: int) -> Path:
        """File of a trial."""
        return self._folder / f"{trial // _A_FOLDER:04d}" / f"{trial:07d}.json"

    def write(self, shard: Shard) -> None:
        """Write a trial atomically."""
        self.put(shard.trial, shard.packed())

    def put(self, trial: int, content: bytes) -> None:
        """Write the packed bytes of a trial atomically."""
        target = self.path(trial)
        target.parent.mkdir(parents=True, exist_ok=True)
        # two writers of the same trial (one of them presumed dead) must not use the same temporary file
        beside = target.with_name(f"{target.name}.{os.getpid()}.part")
        beside.write_bytes(content)
        beside.replace(target)

    def read(self, trial: int) -> Shard | None:
        """A trial; None if it has not been run or its file is damaged."""
        try:
            shard = Shard.unpacked(self.path(trial).read_bytes())
            if {shard.trial, shard.row.get("trial", trial)} != {trial} or not isinstance(shard.row["status"], str):
                return None
            if self._columns:
                if list(shard.row) != [column.name for column in self._columns]:
                    return None
                checked_values(shard.row, self._columns)
            return shard
        except (*_DAMAGED, WarpjldError):
            return None

    def missing(self, count: int) -> list[int]:
        """Numbers of the trials in 0…count − 1 without a valid file."""
        return [trial for trial in range(count) if self.read(trial) is None]

    def all(self, count: int) -> Iterator[Shard]:
        """Trials 0…count − 1 in order.

        Raises:
            LookupError: One is missing.
        """
        for trial in range(count):
            shard = self.read(trial)
            if shard is None:
                raise LookupError(f"trial {trial} has not been run")
            yield shard

    def sweep(self) -> None:
        """Remove temporary files of killed writers."""
        for part in self._folder.glob("*/*.part"):
            part.unlink(missing_ok=True)


def _packed(array: NDArray[Any]) -> dict[str, Any]:
    plain = np.ascontiguousarray(array)
    plain = plain.astype(plain.dtype.newbyteorder("<"), copy=False)
    return {"dtype": plain.dtype.str, "shape": list(plain.shape), "data": base64.b64encode(plain.tobytes()).decode()}


def _unpacked(packed: dict[str, Any]) -> NDArray[Any]:
    raw = np.frombuffer(base64.b64decode(packed["data"]), dtype=np.dtype(packed["dtype"]))
    return raw.reshape(packed["shape"])
