"""Reading of a rig and a motion in a process of its own, while this one imports the libraries that deform."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warpjld.files.kept_files import kept_folder
from warpjld.runtime.ahead import Ahead, LostError
from warpjld.runtime.threads import cores

if TYPE_CHECKING:
    from warpjld.motion.load import LoadedMotion
    from warpjld.rig import Rig

__all__ = ["ReadAhead", "rig_and_motion"]

_LARGEST = 100_000_000
"""Bytes of files that are read ahead: what is larger is read once, and not copied between processes."""
_TO_BIND = (
    "warpjld.covering.kept",
    "scipy.sparse",
    "scipy.linalg",
    "scipy.sparse.linalg",
    "scipy.sparse.csgraph",
    "threadpoolctl",
)
"""Modules that binding needs, and a stored binding does not."""


class ReadAhead:
    """A rig and a motion that are being read.

    Args:
        rig: The rig's file.
        how: Keyword arguments of ``load_rig``.
        motion: The motion's file.
        reading: Keyword arguments of ``load_motion``.
    """

    def __init__(self, rig: str, how: dict[str, Any], motion: Path, reading: dict[str, Any]) -> None:
        self._ahead: Ahead | None = None
        if "warp" in sys.modules:  # nothing is left to import meanwhile
            return
        files = (Path(rig), motion)
        small = all(file.is_file() for file in files) and sum(file.stat().st_size for file in files) <= _LARGEST
        if small and cores() > 1:
            self._ahead = Ahead((__name__, "rig_and_motion"), rig, how, motion, reading)

    def rig(self) -> Rig | None:
        """The rig; None where it must be read here.

        While it is not there, modules are imported that binding it will surely need.

        Raises:
            InputError: As of ``load_rig``.
        """
        if self._ahead is None:
            return None
        for name in _TO_BIND if _binds() else ():
            if not self._ahead.ready():
                import_module(name)
        rig: Rig | None = self._item()
        return rig

    def motion(self) -> LoadedMotion | None:
        """The motion on that rig; None where it must be read here.

        Raises:
            InputError: As of ``load_motion``.
        """
        moved: LoadedMotion | None = self._item()
        return moved

    def end(self) -> None:
        """End the process that reads."""
        if self._ahead is not None:
            self._ahead.end()
            self._ahead = None

    def _item(self) -> Any:
        try:
            return None if self._ahead is None else self._ahead.item()
        except LostError:
            self.end()
            return None


def _binds() -> bool:
    """Whether the cache holds nothing, so that a surface is surely bound."""
    folder = kept_folder()
    return folder is None or next(folder.glob("*.npz"), None) is None


def rig_and_motion(
    rig: str, how: dict[str, Any], motion: Path, reading: dict[str, Any]
) -> Iterator[Rig | LoadedMotion | None]:
    """In the process: the rig, then the motion on it, or None where that is too long to be sent."""
    from warpjld.cli.warn import plain_warnings
    from warpjld.io.kept_rig import kept_rig
    from warpjld.motion.load import load_motion
    from warpjld.skeleton.streamed_poses import StreamedPoses

    plain_warnings()
    read = kept_rig(rig, **how)
    yield read
    moved = load_motion(motion, read, **reading)
    yield None if isinstance(moved.poses, StreamedPoses) else moved
