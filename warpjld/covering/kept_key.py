"""The name under which a binding is kept: a hash of all that it follows from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from warpjld import __version__
from warpjld.covering.parameters import Parameters
from warpjld.files.kept_values import hash_of
from warpjld.files.sources import hash_of_sources, source_files
from warpjld.rig import Rig
from warpjld.skeleton.tree import Skeleton

__all__ = ["binding_key", "binding_sources"]

_MODULES = ("*.py", "covering/*.py", "files/*.py", "geometry/*.py", "rig/*.py", "runtime/*.py", "skeleton/**/*.py")
"""What binding a rig runs through."""


def binding_key(
    rig: Rig, *, skeleton: Skeleton | None = None, parameters: Parameters | None = None, domains: str = "geometry"
) -> str:
    """Hash of what ``bind_rig`` is given, and of the programs that bind."""
    surface = (rig.surface.vertices, rig.surface.faces)
    skin = rig.skin if domains == "skin" else None
    given = (rig.skeleton if skeleton is None else skeleton, parameters, rig.rigid, skin)
    return hash_of(__version__, hash_of_sources(_MODULES), domains, surface, *given)


def binding_sources() -> Iterator[tuple[str, Path]]:
    """Names and places of the files whose content a binding depends on, always in the same order."""
    return source_files(_MODULES)
