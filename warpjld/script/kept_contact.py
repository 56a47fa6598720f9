"""What PRESS has solved is not lost where what follows fails: it is kept as a state, to be exported again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from warpjld.errors import WarpjldError
from warpjld.files.folders import make_folder

if TYPE_CHECKING:
    from warpjld.script.scene import Scene
    from warpjld.simulation.simulate import Keep

__all__ = ["contact_kept"]


@contextmanager
def contact_kept(scene: Scene, folder: Path) -> Iterator[Callable[[Keep], None]]:
    """While contact is solved and shown: where an error or Ctrl-C ends that, what is solved is kept, and told.

    Args:
        scene: Told, as a warning.
        folder: The output folder, which may be gone again.

    Yields:
        For ``simulate``'s ``keeping``.
    """
    known: list[Keep] = []
    try:
        yield known.append
    except BaseException:
        for keep in known:
            scene.warned([line] if (line := _kept(keep, folder)) else [])
        raise


def _kept(keep: Keep, folder: Path) -> str:
    """Keep it; what there is to tell."""
    missing = not folder.exists()
    try:
        make_folder(folder)
        path = keep()
        if path is None and missing:
            folder.rmdir()
    except (WarpjldError, OSError, MemoryError) as error:
        return f"what PRESS has solved cannot be kept: {error}"
    if path is None:
        return ""
    state = path.relative_to(folder)
    return f'what PRESS has solved is kept in {path}: with STATE "{state}" it is exported again, or gone on from'
