"""Results on disk while a study runs: one file a trial, whole or absent."""

from __future__ import annotations

import base64
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
_A_FOLDER = 1000  # file systems and people dislike folders with a hundred thousand files


@dataclass(frozen=True, eq=False)
class Shard:
    """One trial as kept on disk: a row of the table, its arrays, and the wall-clock seconds, which no table has."""

    trial: int
    row: dict[str, Any]
    arrays: dict[str, NDArray[Any]]
    seconds: float

    def packed(self) -> bytes:
        """As it is kept on disk."""
        content = {
            "trial": self.trial,
            "row": self.row,
            "arrays": {name: _packed(array) for name, array in self.arrays.items()},
            "seconds": self.seconds,
        }
        return json.dumps(content, allow_nan=True, ensure_ascii=False).encode("utf-8")

    @staticmethod
    def unpacked(content: bytes) -> Shard:
        """What `packed` made; raises whatever damaged bytes lead to."""
        found = json.loads(content.decode("utf-8"))
        arrays = {name: _unpacked(packed) for name, packed in found["arrays"].items()}
        return Shard(int(found["trial"]), dict(found["row"]), arrays, float(found["seconds"]))

    def results(self) -> bytes:
        """Its results alone, which are the same bits wherever it is run: all but the seconds."""
        return replace(self, seconds=0.0).packed()


class Shards:
    """The folder of trials. Numbers are kept exactly: JSON holds doubles by their shortest decimal form, arrays by
    their bytes.

    Args:
        folder: The folder.
        columns: What the row of a trial must hold to count; empty where any will do.
    """

    def __init__(self, folder: Path, columns: Sequence[Column] = ()) -> None:
        self._folder = folder
        self._columns = columns

    def path(self, trial: int) -> Path:
        """File of a trial."""
        return self._folder / f"{trial // _A_FOLDER:04d}" / f"{trial:07d}.json"

    def write(self, shard: Shard) -> None:
        """Keep a trial; whoever reads sees all of it or nothing, whenever the writer is killed."""
        self.put(shard.trial, shard.packed())

    def put(self, trial: int, content: bytes) -> None:
        """Keep a trial that another machine has packed."""
        target = self.path(trial)
        target.parent.mkdir(parents=True, exist_ok=True)
        # two writers of one trial (a worker thought dead) must not share a file
        beside = target.with_name(f"{target.name}.{os.getpid()}.part")
        beside.write_bytes(content)
        beside.replace(target)

    def read(self, trial: int) -> Shard | None:
        """A trial, or None where it has not been run, or its file is damaged."""
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
        """Trials of 0…count − 1 that have no whole file."""
        return [trial for trial in range(count) if self.read(trial) is None]

    def all(self, count: int) -> Iterator[Shard]:
        """Trials 0…count − 1 in order.

        Raises:
            LookupError: One is not there.
        """
        for trial in range(count):
            shard = self.read(trial)
            if shard is None:
                raise LookupError(f"trial {trial} has not been run")
            yield shard

    def sweep(self) -> None:
        """Remove what killed writers left."""
        for part in self._folder.glob("*/*.part"):
            part.unlink(missing_ok=True)


def _packed(array: NDArray[Any]) -> dict[str, Any]:
    plain = np.ascontiguousarray(array)
    plain = plain.astype(plain.dtype.newbyteorder("<"), copy=False)
    return {"dtype": plain.dtype.str, "shape": list(plain.shape), "data": base64.b64encode(plain.tobytes()).decode()}


def _unpacked(packed: dict[str, Any]) -> NDArray[Any]:
    raw = np.frombuffer(base64.b64decode(packed["data"]), dtype=np.dtype(packed["dtype"]))
    return raw.reshape(packed["shape"])
