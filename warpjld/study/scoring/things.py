"""Which surface file in a folder of objects a grasp means."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path, PurePosixPath

from warpjld.errors import InputError
from warpjld.suggest import did_you_mean

__all__ = ["ObjectFolder"]

_SURFACES = (".obj", ".ply", ".stl", ".off", ".glb", ".gltf")
_CHOSEN = ("simplified", "mesh", "model", "textured", "decomposed")
"""File names that collections give the one surface of an object's folder, in the order they are taken."""

_DEEP = 2
"""Parts of its path in there: ``mesh/simplified.obj``."""


class ObjectFolder:
    """A folder of objects: files, ``ball.obj``, or folders of them, ``ball/mesh/simplified.obj``.

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
        """The surface of a name or path, whose last parts count: what lies nearest to what was asked for.

        Raises:
            InputError: There is none, or several would do: names them.
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
        """The one of several that an object's folder is known by; deeper down lie other objects' folders."""
        near = [file for file in found if below is None or len(file.relative_to(below).parts) <= _DEEP]
        for name in (PurePosixPath(wanted).stem, *_CHOSEN):
            chosen = [file for file in near if file.stem == name]
            if len(chosen) == 1:
                return chosen[0]
        if len(found) > 1:
            few = ", ".join(str(file.relative_to(self._folder)) for file in found[:4])
            raise InputError(f"object '{wanted}' may be any of {few} in {self._folder}: leave one")
        return found[0]
