"""A process that tries inputs of one kind, with limits on memory and time: a crash is a finding and not the end.

``python -m tests.fuzz.worker KIND SEED COUNT FOLDER``: the input being tried lies in FOLDER, findings are printed as
lines of JSON, the last line says how many were tried and the most memory they took.
"""

from __future__ import annotations

import json
import random
import resource
import shutil
import signal
import sys
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tests.fuzz.damage import damaged
from tests.fuzz.grammar import scripts
from tests.fuzz.sound import KINDS, sound
from tests.fuzz.trial import tried

__all__ = ["MEMORY", "SECONDS"]

SECONDS = 20
"""That one input may take."""
MEMORY = 3 << 30
"""Bytes that a process may come to hold."""
_ADDRESSES = 24 << 30  # Warp's compiler maps more than it uses


def main(name: str, start: int, count: int, folder: Path) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, _ADDRESSES))
    path = sound(name, folder)
    data = path.read_bytes()
    KINDS[name][1](path)  # imports and kernels: no input's fault
    tried_so_far = 0

    def attempt(content: bytes) -> None:
        nonlocal tried_so_far
        path.write_bytes(content)
        before = _held()
        signal.alarm(SECONDS)
        told = tried(name, path)
        signal.alarm(0)
        tried_so_far += 1
        if _held() > max(MEMORY, before):
            told = told or f"{_held() >> 20} MiB of memory"
        if told:
            kept = folder / f"found-{start}-{tried_so_far}-{name}"
            shutil.copy(path, kept)
            print(json.dumps({"kind": name, "input": str(kept), "told": told}), flush=True)

    how = settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    drawn = st.randoms(use_true_random=True).map(lambda draw: damaged(data, draw))
    if name == "a.jld":
        drawn = st.one_of(drawn, scripts().map(lambda text: text.encode("utf-8", "surrogatepass")))

    @seed(start)
    @how
    @given(drawn)
    def run(content: bytes) -> None:
        attempt(content)

    random.seed(start)
    run()
    print(json.dumps({"kind": name, "tried": tried_so_far, "memory": _held()}), flush=True)


def _held() -> int:
    """The most memory that this process ever held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
