"""What runs on the machines of a cluster: nothing of it writes, but the inputs that it was sent."""

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
"""Versions that all machines must share: another one may give other last bits."""


@dataclass(frozen=True, eq=False)
class Sent:
    """One input file and those that belong to it, in Ray's store.

    Attributes:
        path: Where it lies on the machine of the study.
        name: Of the file itself, below the folder that all lie in.
        digest: SHA-256 of names and contents.
        files: Name of each file below that folder, its SHA-256, and the reference of its bytes.
    """

    path: str
    name: str
    digest: str
    files: tuple[tuple[str, str, Any], ...]


def ping() -> dict[str, Any]:
    """What this machine is, and the versions of what computes."""
    found: dict[str, Any] = {name: versions([name])[name] for name in MATCHING if name != "sources"}
    about = {"host": platform.node(), "cpu": _cpu_model(), "python": platform.python_version()}
    return about | {"versions": found | {"sources": sources()}}


@lru_cache(maxsize=1)
def sources() -> str:
    """SHA-256 of the program: a version under way changes without its number."""
    import warpjld_kernels

    import warpjld

    digest = hashlib.sha256()
    for package in (warpjld, warpjld_kernels):
        folder = Path(package.__path__[0])
        for file in sorted(folder.rglob("*.py")):
            digest.update(str(file.relative_to(folder).as_posix()).encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()[:16]


_ready: dict[str, Experiment] = {}  # by the driver's key: begun once in a process


def trial_bytes(key: str, held: list[Any], sent: tuple[Sent, ...], trial: int) -> bytes:
    """One trial, packed as it is kept on disk.

    Args:
        key: Of the experiment.
        held: Reference of the experiment in Ray's store, in a list so that it is fetched once in a process only.
        sent: Its inputs.
        trial: Which one.
    """
    import ray

    if key not in _ready:
        experiment: Experiment = ray.get(held[0])
        _ready.clear()
        _ready[key] = experiment.moved({Path(one.path): _placed(one) for one in sent})
        _ready[key].begin()
    return performed(_ready[key], trial).packed()


def _placed(one: Sent) -> Path:
    """Where an input lies on this machine; it is fetched unless it is there already, by its hash."""
    import ray

    from warpjld.files.whole_file import whole_file

    user = os.getuid() if hasattr(os, "getuid") else "user"
    own = Path(tempfile.gettempdir()) / f"warpjld-inputs-{user}"
    own.mkdir(exist_ok=True, mode=0o700)
    if hasattr(os, "getuid") and own.stat().st_uid != os.getuid():
        raise WarpjldError(f"{own} on {platform.node()} belongs to somebody else: remove it")
    folder = own / one.digest
    folder.mkdir(exist_ok=True)
    for name, digest, held in one.files:
        path = folder / name
        if path.is_file() and hashlib.sha256(path.read_bytes()).hexdigest() == digest:
            continue
        content = ray.get(held)
        if hashlib.sha256(content).hexdigest() != digest:
            raise WarpjldError(f"{name}: came to {platform.node()} with other bytes than were sent")
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part:
            part.write_bytes(content)
    return folder / one.name


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()
