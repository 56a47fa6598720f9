"""The text of a script, and the history of its edits: all that a studio keeps."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from pathlib import Path

from warpjld.files.text_file import read_text
from warpjld.files.whole_file import whole_file

__all__ = ["ScriptDocument"]

_TOGETHER = 1.0  # seconds within which edits of one kind are one step of undoing
_MOST_STEPS = 1000


@dataclass(frozen=True)
class _Step:
    """The text before an edit, and what kind of edit it was."""

    before: str
    kind: Hashable


class ScriptDocument:
    """A script being written.

    Edits of one ``kind`` that follow one another closely (a slider being dragged, a word being typed) are undone
    together.

    Attributes:
        path: The file that it is saved to; names of files inside it are relative to that file's folder.
        text: The script.
        saved: The text as the file has it.
    """

    def __init__(self, path: Path, text: str = "", *, clock: Callable[[], float] = time.monotonic) -> None:
        self.path = path
        self.text = text
        self.saved = text
        self._clock = clock
        self._undo: list[_Step] = []
        self._redo: list[_Step] = []
        self._last = -_TOGETHER

    @classmethod
    def open(cls, path: Path) -> ScriptDocument:
        """The script in a file (UTF-8).

        Raises:
            InputError: It cannot be read.
        """
        return cls(path, read_text(path))

    @property
    def changed(self) -> bool:
        """Whether the file does not have the text as it is."""
        return self.text != self.saved

    @property
    def can_redo(self) -> bool:
        """Whether an edit was undone last."""
        return bool(self._redo)

    def edit(self, text: str, kind: Hashable = None) -> None:
        """Replace the text; None as the kind is a step of its own."""
        if text == self.text:
            return
        now = self._clock()
        together = kind is not None and self._undo and self._undo[-1].kind == kind and now - self._last < _TOGETHER
        if not together or self._redo:
            self._undo.append(_Step(self.text, kind))
            del self._undo[:-_MOST_STEPS]
        self._redo.clear()
        self._last = now
        self.text = text

    def append(self, lines: str, kind: Hashable = None) -> None:
        """Add lines at the end."""
        body = self.text.rstrip("\n")
        self.edit(f"{body}\n{lines}\n" if body else f"{lines}\n", kind)

    def undo(self) -> bool:
        """Take the last step back; False where there is none."""
        return self._swap(self._undo, self._redo)

    def redo(self) -> bool:
        """Take the last undone step again; False where there is none."""
        return self._swap(self._redo, self._undo)

    def save(self, path: Path | None = None) -> Path:
        """Write the file, whole or not at all; with a path, that file from now on."""
        self.path = self.path if path is None else path
        self._write(self.path)
        self.saved = self.text
        return self.path

    @property
    def autosaved(self) -> Path:
        """Where ``autosave`` keeps the text."""
        return self.path.with_name(f".{self.path.name}.autosaved")

    def autosave(self) -> None:
        """Keep the text beside the file as long as the file does not have it."""
        if self.changed:
            self._write(self.autosaved)
        else:
            self.autosaved.unlink(missing_ok=True)

    def _write(self, path: Path) -> None:
        with whole_file(path) as part:
            part.write_text(self.text, encoding="utf-8", errors="backslashreplace")

    def _swap(self, source: list[_Step], target: list[_Step]) -> bool:
        if not source:
            return False
        step = source.pop()
        target.append(_Step(self.text, step.kind))
        self.text = step.before
        self._last = -_TOGETHER
        return True
