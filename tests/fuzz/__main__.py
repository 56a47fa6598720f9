"""``python -m tests.fuzz --minutes N``: damaged inputs of every kind that is read, until the time is up.

Each kind runs in a process of its own with 3 GiB and 20 s an input. Findings are printed, their inputs kept in the
folder named at the end, and the exit code is 1 where there are any.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from tests.fuzz.sound import KINDS
from tests.fuzz.worker import SECONDS, forked

__all__ = ["Tally", "fuzz"]

_TURN = 4.0
"""Processor time of one kind before the next has its turn [s]: what is read fast is tried often."""


@dataclass
class Tally:
    """What was tried, and what was found.

    Attributes:
        tried: Inputs by kind.
        found: Findings: kind, what went wrong, where the input lies.
        memory: The most that a process held [bytes].
    """

    tried: Counter[str] = field(default_factory=Counter)
    found: list[tuple[str, str, str]] = field(default_factory=list)
    memory: int = 0


def fuzz(seconds: float, start: int, kinds: list[str], folder: Path, *, turn: float = _TURN) -> Tally:
    """Try inputs of each kind in turn until the time is up, with seeds from ``start`` on; every kind has one turn."""
    tally, until, number = Tally(), time.monotonic() + seconds, start
    while True:
        for name in kinds:
            _turn(tally, name, number, turn, folder)
            if time.monotonic() > until and number > start:
                return tally
        number += 1
        if time.monotonic() > until:
            return tally


def _turn(tally: Tally, name: str, number: int, seconds: float, folder: Path) -> None:
    place = Path(tempfile.mkdtemp(prefix=f"{name}-", dir=folder))
    code, rows = forked(name, number, seconds, place)
    found = 0
    for row in rows:
        if "told" in row:
            tally.found.append((name, str(row["told"]), str(row["input"])))
            found += 1
        else:
            tally.tried[name] += int(str(row["tried"]))
            tally.memory = max(tally.memory, int(str(row["memory"])))
    if code:
        kept = place / f"ended-{number}-{name}"
        if (place / name).exists():
            shutil.copy(place / name, kept)
        what = (
            f"more than {SECONDS} s" if code in (-signal.SIGALRM, -signal.SIGPROF) else f"the process ends with {code}"
        )
        said = (place / "stderr").read_text(errors="replace").strip() if (place / "stderr").exists() else ""
        tally.found.append((name, f"{what}\n{said[-800:]}", str(kept)))
    elif not found:
        shutil.rmtree(place, ignore_errors=True)
    print(f"seed {number} {name}: {tally.tried[name]:,} inputs, {len(tally.found)} findings so far", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0, help="how long")
    parser.add_argument("--seed", type=int, default=1, help="of the first turn; each following one has the next")
    parser.add_argument("--kinds", nargs="*", choices=list(KINDS), default=list(KINDS), help="only these")
    parser.add_argument("--turn", type=float, default=_TURN, help="seconds of a kind before the next has its turn")
    given = parser.parse_args()
    os.environ |= {"OMP_NUM_THREADS": "1", "WARPJLD_CACHE": "off", "WARPJLD_LIMIT_MESH_SECONDS": "4"}
    folder = Path(tempfile.mkdtemp(prefix="warpjld-fuzz-"))
    tally = fuzz(60.0 * given.minutes, given.seed, given.kinds, folder, turn=given.turn)
    for kind, told, path in tally.found:
        print(f"{kind}: {' | '.join(told.strip().splitlines()[-3:])}\n  {path}")
    print(", ".join(f"{kind} {count:,}" for kind, count in tally.tried.items()))
    print(
        f"{sum(tally.tried.values()):,} inputs of {len(tally.tried)} kinds, {len(tally.found)} findings, "
        f"at most {tally.memory >> 20} MiB; {folder}"
    )
    return bool(tally.found)


if __name__ == "__main__":
    sys.exit(main())
