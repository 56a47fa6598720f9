"""Key of a stored binding: a hash of its inputs and of the program files that compute it."""

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
"""Program files that binding a rig executes."""


def binding_key(
    rig: Rig, *, skeleton: Skeleton | None = None, parameters: Parameters | None = None, domains: str = "geometry"
) -> str:
    """Hash of the arguments of ``bind_rig``, the version, and the program files that bind."""
    surface = (rig.surface.vertices, rig.surface.faces)
    skin = rig.skin if domains == "skin" else None
    given = (rig.skeleton if skeleton is None else skeleton, parameters, rig.rigid, skin)
    return hash_of(__version__, hash_of_sources(_MODULES), domains, surface, *given)


def binding_sources() -> Iterator[tuple[str, Path]]:
    """Names and paths of the program files that a binding depends on, in a fixed order."""
    return source_files(_MODULES)
