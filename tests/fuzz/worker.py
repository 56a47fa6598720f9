"""A process that tries inputs of one kind, with limits on memory and time: a crash is a finding and not the end."""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import sys
import traceback
from collections.abc import Callable
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tests.fuzz.damage import damaged
from tests.fuzz.grammar import scripts
from tests.fuzz.sound import KINDS, sound
from tests.fuzz.trial import tried

__all__ = ["MEMORY", "SECONDS", "forked"]

SECONDS = 20
"""Of processor time that one input may take."""
_WAIT = 10 * SECONDS
"""Seconds by the clock: what waits for others, or for nothing, ends too."""
MEMORY = 3 << 30
"""Bytes that a process may come to hold."""
_ADDRESSES = 8 << 30  # Warp's compiler maps more than it uses


def forked(name: str, start: int, count: int, folder: Path) -> tuple[int, list[dict[str, object]]]:
    """Try inputs in a child of this process, which has imported everything.

    Args:
        name: The kind.
        start: Seed.
        count: How many inputs.
        folder: Where the input being tried lies, and those of findings.

    Returns:
        How the child ended, as ``os.waitstatus_to_exitcode`` tells it, and its rows: findings, and at the end how many
        were tried and the most memory that was held.
    """
    told = folder / "told"
    told.touch()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            with told.open("w", buffering=1) as out:
                os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
                os.dup2(os.open(folder / "stderr", os.O_WRONLY | os.O_CREAT), 2)
                _try_many(name, start, count, folder, lambda row: print(json.dumps(row), file=out))
            code = 0
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    rows = [json.loads(line) for line in told.read_text().splitlines() if line.endswith("}")]
    return os.waitstatus_to_exitcode(status), rows


def _try_many(name: str, start: int, count: int, folder: Path, tell: Callable[[dict[str, object]], None]) -> None:
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
        signal.alarm(_WAIT)
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        told = tried(name, path)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.alarm(0)
        tried_so_far += 1
        if _held() > max(MEMORY, before):
            told = told or f"{_held() >> 20} MiB of memory"
        if told:
            kept = folder / f"found-{start}-{tried_so_far}-{name}"
            shutil.copy(path, kept)
            tell({"input": str(kept), "told": told})

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
    tell({"tried": tried_so_far, "memory": _held()})


def _held() -> int:
    """The most memory that this process ever held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
