"""Rigs stored in files: reading one and recognising its joints takes longer than deforming a hundred frames of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from warpjld.files.kept_files import kept_folder
from warpjld.files.kept_values import hash_of, kept_value
from warpjld.files.manifest import file_hash
from warpjld.files.sources import source_files
from warpjld.geometry.surface import Part, Surface
from warpjld.io.rig_file import load_rig
from warpjld.limits import LIMITS, check_limit, limit
from warpjld.rig import Rig, Skin
from warpjld.skeleton.recognise.tree import SourceTree
from warpjld.skeleton.tree import Skeleton

__all__ = ["kept_rig", "rig_sources"]

_WHOLE = (".glb", ".vrm")  # formats whose files contain all that is read, buffers and textures too
_CLASSES = (Part, Rig, Skeleton, Skin, SourceTree, Surface)
_MODULES = (
    "*.py",
    "files/*.py",
    "geometry/*.py",
    "io/*.py",
    "io/gltf/*.py",
    "rig/*.py",
    "runtime/*.py",
    "skeleton/**/*.py",
)
"""Program files that reading a rig of these formats executes."""


def kept_rig(path: str | Path, **how: Any) -> Rig:
    """``load_rig``, read from the user's cache folder where the same file was read in the same way before.

    Args:
        path: The file; formats that may refer to other files are always read anew.
        how: Keyword arguments of ``load_rig``; files among them count with their content.

    Raises:
        InputError: As of ``load_rig``.
    """
    path = Path(path)
    files = {
        name: Path(value) for name, value in how.items() if value and (name == "skeleton" or isinstance(value, Path))
    }
    found = all(file.is_file() for file in (path, *files.values()))
    if kept_folder() is None or path.suffix.lower() not in _WHOLE or not found:
        return load_rig(path, **how)
    check_limit("file-bytes", path.stat().st_size, path=path)
    hashes = {name: file_hash(file) for name, file in ({"rig": path} | files).items()}
    limits = {name: limit(name) for name in LIMITS}
    key = hash_of(path.stem, hashes, {name: value for name, value in how.items() if name not in files}, limits)
    rig, _ = kept_value("rig", key, _CLASSES, lambda: replace(load_rig(path, **how), path=None), modules=_MODULES)
    return replace(rig, path=path)


def rig_sources() -> Iterator[tuple[str, Path]]:
    """Names and paths of the program files that a kept rig depends on, in a fixed order."""
    return source_files(_MODULES)
