"""A study quick enough for a thousand trials, some of which go wrong.

As a script it runs in a process that can be killed: ``python -m tests.study.dice OUT TRIALS PROCESSES [pause]``."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import WarpjldError
from warpjld.study import Column, Outcome, run_study


@dataclass(frozen=True)
class Dice:
    trials: int = 1000
    seed: int = 3
    pause: float = 0.0
    fatal: int = -1
    """Trial that kills its process, always."""
    fatal_once: str = ""
    """File that trial 7 makes before it kills its process; it lives where the file is there."""

    columns = (
        Column("thrown", "number", "m", "A number."),
        Column("wide", "truth", "", "Whether it is above a half."),
        Column("table", "text", "", "Where it was thrown."),
    )
    success = "wide"
    shown = ("thrown",)
    groups = ("table",)

    def plan(self, trial: int) -> dict[str, Any]:
        return {"table": "ab"[trial % 2]}

    def identity(self) -> dict[str, Any]:
        return {"seed": self.seed, "game": "dice"}

    def begin(self) -> None:
        pass

    def run(self, trial: int, rng: np.random.Generator) -> Outcome:
        if self.pause:
            time.sleep(self.pause)
        if trial == self.fatal or (trial == 7 and self.fatal_once and _first(Path(self.fatal_once))):
            os.kill(os.getpid(), signal.SIGKILL)
        thrown = rng.random()
        if trial % 50 == 13:
            raise WarpjldError("fell off the table")
        if trial % 50 == 14:
            raise ZeroDivisionError("no table")
        values = {"thrown": np.nan if trial % 50 == 15 else thrown, "wide": thrown > 0.5}
        # sums whose last bits depend on the order of summation
        pose = rng.normal(size=(40, 40)) @ rng.normal(size=(40, 40))
        return Outcome("thrown", values, {f"pose {'ab'[trial % 2]}": pose[: 2 + trial % 2]})

    def overall(self, rows: Sequence[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
        return {"thrown": sum(row["thrown"] is not None for row in rows)}

    def inputs(self) -> tuple[Path, ...]:
        return ()

    def moved(self, places: Mapping[Path, Path]) -> Dice:
        return self

    def pictures(self, trial: int, outcome: Outcome, folder: Path) -> list[Path]:
        (folder / "die.txt").write_text(str(outcome.values["thrown"]))
        return [folder / "die.txt"]


def edit_trial(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change the content of a stored trial, with a checksum that fits."""
    content = json.loads(file.read_bytes().partition(b"\n")[0])
    change(content)
    line = json.dumps(content).encode()
    file.write_bytes(line + b"\n" + hashlib.blake2b(line, digest_size=16).hexdigest().encode())


def _first(mark: Path) -> bool:
    known = mark.exists()
    mark.touch()
    return not known


def main() -> None:
    out, trials, processes, *pause = sys.argv[1:]
    dice = Dice(trials=int(trials), pause=float(pause[0]) if pause else 0.0)
    run_study(dice, out, processes=int(processes))


if __name__ == "__main__":
    main()
