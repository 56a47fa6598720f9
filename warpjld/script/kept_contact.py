"""Saves the state of a contact simulation when an error or Ctrl-C ends a run after PRESS has solved frames."""

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
    """Context in which contact is solved and exported; on an exception, the frames solved so far are saved.

    Args:
        scene: Is warned of where the state was saved.
        folder: The output folder; made again if it was removed.

    Yields:
        Function to pass to ``simulate`` as ``keeping``.
    """
    known: list[Keep] = []
    try:
        yield known.append
    except BaseException:
        for keep in known:
            scene.warned([line] if (line := _kept(keep, folder)) else [])
        raise


def _kept(keep: Keep, folder: Path) -> str:
    """Save the state; a message for the user, empty if there was nothing to save."""
    missing = not folder.exists()
    try:
        make_folder(folder)
        path = keep()
        if path is None and missing:
            folder.rmdir()
    except (WarpjldError, OSError, MemoryError) as error:
        return f"the frames that PRESS has solved cannot be saved: {error}"
    if path is None:
        return ""
    state = path.relative_to(folder)
    return f'the frames that PRESS has solved are kept in {path}: PRESS … STATE "{state}" exports them or continues'
