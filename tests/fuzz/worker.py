"""A process that tries inputs of one kind, with limits on memory and time: a crash is a finding and not the end."""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings

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
_PATIENCE = 8
"""Times as long as its processor time a turn may take by the clock of what is read in a process that is not counted."""
_MESH_SECONDS = "WARPJLD_LIMIT_MESH_SECONDS"
_BATCH = 25  # inputs of one way of making them before the other has its turn
_ADDRESSES = 8 << 30  # Warp's compiler maps more than it uses


def forked(name: str, start: int, seconds: float, folder: Path) -> tuple[int, list[dict[str, object]]]:
    """Try inputs in a child of this process, which has imported everything.

    Args:
        name: The kind.
        start: Seed.
        seconds: Of processor time, after which no further input is tried.
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
                _try_many(name, start, seconds, folder, lambda row: print(json.dumps(row), file=out))
            code = 0
        except BaseException:
            traceback.print_exc()
            sys.stderr.flush()
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    rows = [json.loads(line) for line in told.read_text().splitlines() if line.endswith("}")]
    return os.waitstatus_to_exitcode(status), rows


def _try_many(name: str, start: int, seconds: float, folder: Path, tell: Callable[[dict[str, object]], None]) -> None:
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (_ADDRESSES, _ADDRESSES))
    os.environ["WARPJLD_LIMIT_READER_SECONDS"] = str(_WAIT)
    path = sound(name, folder)
    data = path.read_bytes()
    _first(lambda: KINDS[name][1](path))
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

    apart = "usd" in name or name.endswith(".fbx")
    until, late, batch = _spent() + seconds, time.monotonic() + _PATIENCE * seconds, 0

    def goes_on() -> bool:
        return _spent() < until and not (apart and time.monotonic() > late)

    while goes_on():  # always the same inputs, of which a faster machine tries more
        for k in range(_BATCH):
            if goes_on():
                attempt(damaged(data, random.Random(f"{start} {batch} {k}")))
        if name == "a.jld":
            _by_grammar(1000 * start + batch, lambda text: attempt(text.encode("utf-8", "surrogatepass")))
        batch += 1
    tell({"tried": tried_so_far, "memory": _held()})


def _first(read: Callable[[], object]) -> None:
    """Read what is sound: imports and kernels take time that is no input's fault, and more on a busy machine."""
    limit = os.environ.get(_MESH_SECONDS)
    os.environ[_MESH_SECONDS] = str(_WAIT)
    read()
    if limit is None:
        del os.environ[_MESH_SECONDS]
    else:
        os.environ[_MESH_SECONDS] = limit


def _by_grammar(number: int, attempt: Callable[[str], None]) -> None:
    """Try scripts of the language's own grammar."""
    every, phases = list(HealthCheck), [Phase.generate]
    how = settings(max_examples=_BATCH, database=None, deadline=None, phases=phases, suppress_health_check=every)
    seed(number)(how(given(scripts())(attempt)))()


def _spent() -> float:
    """Processor time of this process and those that it started [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _held() -> int:
    """The most memory that this process ever held [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
