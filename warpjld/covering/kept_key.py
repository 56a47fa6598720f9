"""The name under which a binding is kept: a hash of all that it follows from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from warpjld import __version__
from warpjld.covering.parameters import Parameters
from warpjld.rig import Rig
from warpjld.skeleton.tree import Skeleton

__all__ = ["binding_key", "binding_sources"]

# modules of the package that binding a rig runs through, besides all kernels; tests/covering/test_kept_key.py finds
# those that are missing here
_MODULES = (
    "covering/*.py",
    "skeleton/**/*.py",
    "coincident.py",
    "errors.py",
    "input_file.py",
    "kept_files.py",
    "lazily.py",
    "limits.py",
    "listed.py",
    "nesting.py",
    "normals.py",
    "reading.py",
    "rig/*.py",
    "rotations.py",
    "scales.py",
    "spread.py",
    "suggest.py",
    "surface.py",
    "text_file.py",
    "threads.py",
    "whole_file.py",
)


def binding_key(
    rig: Rig, *, skeleton: Skeleton | None = None, parameters: Parameters | None = None, domains: str = "geometry"
) -> str:
    """Hash of what ``bind_rig`` is given, and of the programs that bind."""
    digest = hashlib.sha256(f"{__version__} {_hash_of_sources()} {domains}".encode())
    surface = (rig.surface.vertices, rig.surface.faces)
    skin = rig.skin if domains == "skin" else None
    for part in (surface, rig.skeleton if skeleton is None else skeleton, parameters, rig.rigid, skin):
        _feed(digest, part)
    return digest.hexdigest()


def binding_sources() -> Iterator[tuple[str, Path]]:
    """Names and places of the files whose content a binding depends on, always in the same order."""
    import warpjld_kernels

    import warpjld

    package, kernels = Path(warpjld.__path__[0]), Path(warpjld_kernels.__path__[0])
    for folder, patterns in ((package, _MODULES), (kernels, ("*.py",))):
        for file in sorted(file for pattern in patterns for file in folder.glob(pattern)):
            yield f"{folder.name}/{file.relative_to(folder).as_posix()}", file


@cache
def _hash_of_sources() -> str:
    """Of their content: a version under way changes without its number, and times and sizes of files say too little."""
    digest = hashlib.sha256()
    for name, file in binding_sources():
        digest.update(name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _feed(digest: Any, value: Any) -> None:
    """Every number that a value holds, and what it is: values that differ feed different bytes."""
    if isinstance(value, np.ndarray):
        digest.update(f"{value.dtype.str}{value.shape}".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif is_dataclass(value):
        for field in fields(value):
            digest.update(field.name.encode())
            _feed(digest, getattr(value, field.name))
    elif isinstance(value, (tuple, list)):
        digest.update(f"({len(value)}".encode())
        for part in value:
            _feed(digest, part)
    else:
        digest.update(f"{type(value).__name__}:{value!r};".encode())
