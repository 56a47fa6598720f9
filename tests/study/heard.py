"""A study that reads a file, and tells where it ran."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.study import Column, Outcome


@dataclass(frozen=True)
class Heard:
    file: Path
    trials: int = 4
    seed: int = 1

    columns = (
        Column("said", "text", "", "What the file holds."),
        Column("beside", "text", "", "What the file beside it holds."),
        Column("path", "text", "", "Where it lay."),
        Column("threads", "text", "", "Threads that libraries were allowed."),
        Column("good", "truth", "", "Always."),
    )
    success, shown, groups = "good", (), ()

    def plan(self, trial: int) -> dict[str, Any]:
        return {}

    def identity(self) -> dict[str, Any]:
        return {"file": self.file.read_text()}

    def begin(self) -> None:
        pass

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        return {}

    def inputs(self) -> tuple[Path, ...]:
        return (self.file,)

    def moved(self, places: Mapping[Path, Path]) -> Heard:
        return replace(self, file=places[self.file])

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        beside = self.file.with_name("data.bin")
        said = {"said": self.file.read_text(), "beside": beside.read_text() if beside.exists() else ""}
        threads = ",".join(os.environ[name] for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"))
        return Outcome("heard", {**said, "path": str(self.file), "threads": threads, "good": True})

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        return []
