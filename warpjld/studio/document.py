"""The script as a document: its text, undo history, saving and autosaving."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from pathlib import Path

from warpjld.files.text_file import read_text
from warpjld.files.whole_file import whole_file

__all__ = ["ScriptDocument"]

_TOGETHER = 1.0  # time within which edits of one kind are merged into one undo step [s]
_MOST_STEPS = 1000  # length of the undo history


@dataclass(frozen=True)
class _Step:
    """Undo step: the text before an edit, and the edit's kind."""

    before: str
    kind: Hashable


class ScriptDocument:
    """A script with its undo history.

    Consecutive edits of one ``kind`` within a second (a slider being dragged, a word being typed) are one undo step.

    Attributes:
        path: The file that it is saved to; file names in the script are relative to that file's folder.
        text: The script.
        saved: The text in the file.
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
        """Read a script from a file (UTF-8).

        Raises:
            InputError: It cannot be read.
        """
        return cls(path, read_text(path))

    @property
    def changed(self) -> bool:
        """Whether the text differs from the file."""
        return self.text != self.saved

    @property
    def can_redo(self) -> bool:
        """Whether an undone edit can be redone."""
        return bool(self._redo)

    def edit(self, text: str, kind: Hashable = None) -> None:
        """Replace the text; an edit of kind None is never merged with another."""
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
        """Undo the last step; False if there is none."""
        return self._swap(self._undo, self._redo)

    def redo(self) -> bool:
        """Redo the last undone step; False if there is none."""
        return self._swap(self._redo, self._undo)

    def save(self, path: Path | None = None) -> Path:
        """Write the file atomically; a path changes the document's file."""
        self.path = self.path if path is None else path
        self._write(self.path)
        self.saved = self.text
        return self.path

    @property
    def autosaved(self) -> Path:
        """File that ``autosave`` writes."""
        return self.path.with_name(f".{self.path.name}.autosaved")

    def autosave(self) -> None:
        """Write the text to ``autosaved`` if it is not saved, else remove that file."""
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
