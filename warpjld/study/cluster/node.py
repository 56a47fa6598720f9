"""Code that runs on the machines of a cluster; it writes no files except copies of the inputs it was sent."""

from __future__ import annotations

import hashlib
import os
import platform
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from warpjld.errors import WarpjldError
from warpjld.files.manifest import versions
from warpjld.study.experiment import Experiment
from warpjld.study.pool import performed

__all__ = ["MATCHING", "Sent", "ping", "sources", "trial_bytes"]

MATCHING = ("warpjld", "sources", "warp-lang", "numpy", "scipy")
"""Packages whose versions must be the same on all machines, since another version may give other last bits."""


@dataclass(frozen=True, eq=False)
class Sent:
    """An input file and the files it refers to, in Ray's object store.

    Attributes:
        path: Its path on the driver's machine.
        name: Its name relative to the common folder of all these files.
        digest: SHA-256 of names and contents.
        files: For each file its name relative to that folder, its SHA-256, and the reference of its bytes.
    """

    path: str
    name: str
    digest: str
    files: tuple[tuple[str, str, Any], ...]


def ping() -> dict[str, Any]:
    """Host name, processor, Python and package versions of this machine."""
    found: dict[str, Any] = {name: versions([name])[name] for name in MATCHING if name != "sources"}
    about = {"host": platform.node(), "cpu": _cpu_model(), "python": platform.python_version()}
    return about | {"versions": found | {"sources": sources()}}


@lru_cache(maxsize=1)
def sources() -> str:
    """SHA-256 of the program's source files: during development they change without the version number."""
    import warpjld_kernels

    import warpjld

    digest = hashlib.sha256()
    for package in (warpjld, warpjld_kernels):
        folder = Path(package.__path__[0])
        for file in sorted(folder.rglob("*.py")):
            digest.update(str(file.relative_to(folder).as_posix()).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


_ready: dict[str, Experiment] = {}  # experiment by the driver's key, loaded once per process


def trial_bytes(key: str, program: str, held: list[Any], sent: tuple[Sent, ...], trial: int) -> bytes:
    """Run one trial; its packed shard.

    Args:
        key: Key of the experiment.
        program: ``sources`` of the driver.
        held: Reference of the experiment in the object store, in a list so that Ray does not resolve it for every call.
        sent: Its input files.
        trial: Number of the trial.

    Raises:
        WarpjldError: The program's files have changed since the study began; its bits would be others.
    """
    import ray

    if key not in _ready:
        if sources() != program:
            raise WarpjldError("the program's files have changed since the study began; start it again")
        experiment: Experiment = ray.get(held[0])
        _ready.clear()
        _ready[key] = experiment.moved({Path(file.path): _placed(file) for file in sent})
        _ready[key].begin()
    return performed(_ready[key], trial).packed()


def _placed(source: Sent) -> Path:
    """Path of an input on this machine; fetched unless a file with the same hash is there already."""
    import ray

    from warpjld.files.whole_file import whole_file

    user = os.getuid() if hasattr(os, "getuid") else "user"
    own = Path(tempfile.gettempdir()) / f"warpjld-inputs-{user}"
    own.mkdir(exist_ok=True, mode=0o700)
    if hasattr(os, "getuid") and own.stat().st_uid != os.getuid():
        raise WarpjldError(f"{own} on {platform.node()} belongs to somebody else: remove it")
    folder = own / source.digest
    folder.mkdir(exist_ok=True)
    for name, digest, held in source.files:
        path = folder / name
        if path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == digest:
            continue
        content = ray.get(held)
        if hashlib.sha256(content).hexdigest() != digest:
            raise WarpjldError(f"{name}: the copy that arrived on {platform.node()} is damaged")
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part:
            part.write_bytes(content)
    return folder / source.name


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
