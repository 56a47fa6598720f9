"""Opening the studio with a script, a rig, or the built-in hand."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from warpjld.errors import InputError, WarpjldError
from warpjld.files.text_file import read_text
from warpjld.studio.document import ScriptDocument
from warpjld.studio.state import StudioState

__all__ = ["opened_document", "readable"]

_NEW = "HAND LEFT BUILTIN\n"


def opened_document(path: Path | None, folder: Path, *, device: str = "cpu") -> StudioState:
    """State of a studio with a script (.jld), a rig, or the built-in hand.

    A script that searches for grasps is run up to the first search; a room searches in the background.
    Files may be read from the script's folder, and elsewhere those that the script names when it is opened.

    Raises:
        InputError: There is no such file, or the rig cannot be read.
    """
    if path is None:
        document = ScriptDocument(Path("untitled.jld").resolve(), _NEW)
    elif not path.is_file():
        raise InputError("no such file", path=path)
    elif path.suffix.lower() == ".jld":
        document = ScriptDocument.open(path.resolve())
    else:
        document = ScriptDocument(path.resolve().with_suffix(".jld"), _staging(path))
    if document.autosaved.is_file() and (kept := read_text(document.autosaved)) != document.text:
        document.edit(kept)  # the autosaved text of an earlier session; undo restores the file's text
    return StudioState(document, folder, within=readable(document), device=device, wait=True)


def readable(document: ScriptDocument) -> list[Path]:
    """Paths that a script may read: its folder, and the files it names when it is opened."""
    return [document.path.parent, *_named(document)]


def _staging(path: Path) -> str:
    """Script line that adds a rig."""
    from warpjld.io import load_rig

    names = load_rig(path).skeleton.names
    sides = [side for side in ("left", "right") if f"{side}.wrist" in names]
    body = len(sides) != 1
    return f'BODY "{path.name}"\n' if body else f'HAND {sides[0].upper()} "{path.name}"\n'


def _named(document: ScriptDocument) -> list[Path]:
    """Files that a script reads."""
    from warpjld.studio.performance import Performance

    with suppress(WarpjldError):  # errors of the script are shown in the studio
        return Performance(Path("out"), say=lambda line: None).read_by(document.text, document.path)
    return []
