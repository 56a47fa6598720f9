"""Finding the surface file of a grasp's object in a folder."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path, PurePosixPath

from warpjld.errors import InputError
from warpjld.suggest import did_you_mean

__all__ = ["ObjectFolder"]

_SURFACES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
_CHOSEN = ("simplified", "mesh", "model", "textured", "decomposed")
"""Common names of the main surface in an object's folder, in order of preference."""

_DEEP = 2
"""Largest depth of that surface in the folder, in parts of its path: ``mesh/simplified.obj``."""


class ObjectFolder:
    """A folder of objects: files such as ``ball.obj``, or folders such as ``ball/mesh/simplified.obj``.

    Args:
        folder: The folder.

    Raises:
        InputError: There are no surfaces in it.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files = sorted(f for f in folder.rglob("*") if f.suffix.lower() in _SURFACES and f.is_file())
        if not self._files:
            raise InputError(f"has no surfaces ({', '.join(_SURFACES)})", path=folder)
        self._by_name: dict[str, list[Path]] = defaultdict(list)
        for file in self._files:
            inside = file.relative_to(folder)
            for name in {file.stem, *inside.parts[:-1]}:
                self._by_name[name].append(file)

    def find(self, wanted: str) -> Path:
        """Surface file for a name or path; of a path the longest trailing part that exists in this folder is used.

        Raises:
            InputError: There is none, or several match; names them.
        """
        parts = PurePosixPath(wanted.replace("\\", "/")).parts
        for k in range(len(parts)):
            tail = parts[k:]
            if ".." in tail or tail[0] == "/":
                continue
            below = self._folder.joinpath(*tail)
            if below in self._files:
                return below
            found = [file for file in self._files if below in file.parents]
            if found:
                return self._only(found, wanted, below)
        for part in reversed(parts):
            found = self._by_name.get(PurePosixPath(part).stem if part.lower().endswith(_SURFACES) else part, [])
            if found:
                return self._only(found, wanted, None)
        known = sorted(self._by_name)
        raise InputError(f"no object '{wanted}' in {self._folder}{did_you_mean(wanted, known)}")

    def _only(self, found: list[Path], wanted: str, below: Path | None) -> Path:
        """The main surface among several files of an object; files deeper than ``_DEEP`` belong to other objects."""
        near = [file for file in found if below is None or len(file.relative_to(below).parts) <= _DEEP]
        for name in (PurePosixPath(wanted).stem, *_CHOSEN):
            chosen = [file for file in near if file.stem == name]
            if len(chosen) == 1:
                return chosen[0]
        if len(found) > 1:
            few = ", ".join(str(file.relative_to(self._folder)) for file in found[:4])
            raise InputError(f"object '{wanted}' may be any of {few} in {self._folder}: leave one")
        return found[0]
