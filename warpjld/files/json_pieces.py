"""JSON files of any size: containers larger than a piece are indexed, and their items decoded when they are needed.

Python's own decoder reads each item, so that numbers are the same as of a file that is read whole, and an item can be
read again; a parser of events gives neither, nor the place of an item in the file.
"""

from __future__ import annotations

import codecs
import json
import os
import re
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.input_file import open_input
from warpjld.files.nesting import nesting
from warpjld.files.text_file import json_integer
from warpjld.limits import check_limit, limit

__all__ = ["JSON_LISTS", "JsonList", "JsonObject", "json_pieces"]

_PIECE = 1 << 20
"""Size from which a container's items are decoded one by one [bytes]; as Python objects, ten times as much."""
_BLOCK = 1024  # items of a list that are gathered before they become rows of an array
_SPACE = re.compile(r"[ \t\r\n]*")
_decoder = json.JSONDecoder(parse_int=json_integer)


@contextmanager
def json_pieces(path: str | Path, *, lines: bool = False, piece: int = _PIECE) -> Iterator[Any]:
    """Content of a JSON file in UTF-8, checked as a whole; it can be used as long as the context lasts.

    Args:
        path: The file.
        lines: Whether it holds one JSON value a line (JSON Lines), which become a list.
        piece: Size from which containers are a ``JsonList`` or ``JsonObject`` [bytes].

    Raises:
        InputError: The file cannot be read, or is not JSON; names line and column. Or it exceeds a limit: ``depth``, or
            ``frames`` for the items of its large lists and objects together.
    """
    with open_input(path) as file:
        if file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
            check_limit("json-bytes", os.fstat(file.fileno()).st_size, of="JSON in UTF-16 (save as UTF-8)", path=path)
        file.seek(0)
        yield _Scan(file, Path(path), piece).content(lines)


class _Items:
    """Spans of a container's items in a file; those larger than a piece are containers again."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._spans = array("q")  # first byte and byte after the last of each item, alternating
        self._large: dict[int, JsonList | JsonObject] = {}

    def add(self, start: int, stop: int, large: JsonList | JsonObject | None) -> None:
        """Append an item."""
        if large is not None:
            self._large[len(self)] = large
        self._spans.extend((start, stop))

    def __len__(self) -> int:
        return len(self._spans) // 2

    def at(self, k: int) -> Any:
        """Value of an item."""
        if k in self._large:
            return self._large[k]
        start, stop = self._spans[2 * k : 2 * k + 2]
        self._file.seek(start)
        return _decoder.decode(self._file.read(stop - start).decode())


class JsonList(Sequence[Any]):
    """A list in a JSON file, whose items are decoded at each access."""

    def __init__(self, items: _Items) -> None:
        self._items = items

    def __len__(self) -> int:
        return len(self._items)

    def __getitem__(self, k: Any) -> Any:
        if isinstance(k, slice):
            return [self._items.at(i) for i in range(*k.indices(len(self)))]
        if not -len(self) <= k < len(self):
            raise IndexError(f"no item {k} in a list of {len(self)}")
        return self._items.at(k % len(self))

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """As ``np.array`` of the list; raises ValueError unless it holds numbers, as many in every item."""
        blocks: list[NDArray[Any]] = []
        for first in range(0, len(self), _BLOCK):
            block = np.asarray(self[first : first + _BLOCK], dtype=dtype)
            if block.dtype == object or (blocks and block.shape[1:] != blocks[0].shape[1:]):
                raise ValueError("items are not arrays of numbers of one shape")
            blocks.append(block)
        return np.concatenate(blocks) if blocks else np.zeros(0)


class JsonObject(Mapping[str, Any]):
    """An object in a JSON file, whose values are decoded at each access."""

    def __init__(self, items: _Items, names: Mapping[str, int]) -> None:
        self._items, self._names = items, names

    def __len__(self) -> int:
        return len(self._names)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __getitem__(self, name: str) -> Any:
        return self._items.at(self._names[name])


JSON_LISTS = (list, JsonList)
"""Types of a list in JSON content."""


class _Scan:
    """One pass over a file. Its text is taken as Latin-1, so that characters are bytes; UTF-8 is checked beside."""

    def __init__(self, file: BinaryIO, path: Path, piece: int) -> None:
        self._file, self._path, self._piece = file, path, piece
        self._utf8 = codecs.getincrementaldecoder("utf-8")()
        self._text, self._at, self._before, self._lines, self._line_at = "", 0, 0, 0, 0
        self._ended, self._count = False, 0
        self._more()
        if self._text.startswith("ï»¿"):  # the byte order mark
            self._at = 3

    def content(self, lines: bool) -> Any:
        """The whole file's value."""
        if lines:
            value: Any = JsonList(self._listed(0, end=""))
        else:
            start, stop, large = self._item(0)
            alone = _Items(self._file)
            alone.add(start, stop, large)
            if self._mark():
                raise self._wrong("Extra data")
            value = alone.at(0)
        return value

    def _more(self) -> None:
        """Read on, so that at least a piece lies ahead, and drop what lies behind."""
        if self._ended or len(self._text) - self._at >= self._piece:
            return
        try:
            raw = self._file.read(2 * self._piece)
            self._ended = not raw
            self._utf8.decode(raw, self._ended)
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", path=self._path) from None
        except UnicodeDecodeError as error:
            place = self._before + len(self._text) + error.start
            raise InputError(f"is not UTF-8 text (near byte {place})", path=self._path) from None
        self._lines += self._text.count("\n", 0, self._at)
        newline = self._text.rfind("\n", 0, self._at)
        self._line_at = self._before + newline + 1 if newline >= 0 else self._line_at
        self._text = self._text[self._at :] + raw.decode("latin-1")
        self._before, self._at = self._before + self._at, 0
        self._more()

    def _mark(self) -> str:
        """The next character that is no space; empty at the end."""
        while True:
            self._more()
            self._at = _SPACE.match(self._text, self._at).end()  # type: ignore[union-attr]  # matches nothing as well
            if self._at < len(self._text) or self._ended:
                self._more()
                return self._text[self._at : self._at + 1]

    def _take(self, mark: str) -> bool:
        found = bool(mark) and self._mark() == mark
        self._at += found
        return found

    def _item(self, level: int) -> tuple[int, int, JsonList | JsonObject | None]:
        """Span of the value that comes next; its index too if it is larger than a piece."""
        check_limit("depth", level, of="JSON", path=self._path)
        mark, start = self._mark(), self._before + self._at
        try:
            _, stop = _decoder.raw_decode(self._text, self._at)
        except (json.JSONDecodeError, RecursionError) as error:
            if mark == "[":
                self._at += 1
                return start, self._before + self._at, JsonList(self._listed(level + 1, end="]"))
            if mark == "{":
                self._at += 1
                return start, self._before + self._at, self._object(level + 1)
            if mark == '"' and not self._ended:
                raise self._wrong(f"a text of {self._piece} bytes or more") from None
            if isinstance(error, json.JSONDecodeError):
                self._at = error.pos
                raise self._wrong(error.msg) from None
            raise
        if stop == len(self._text) and not self._ended and mark not in '[{"':  # it may go on in what follows
            raise self._wrong(f"a number of {self._piece} digits or more")
        if self._text.count("[", self._at, stop) + self._text.count("{", self._at, stop) > limit("depth") - level:
            deep = level + nesting(self._text[self._at : stop].encode("latin-1"))
            check_limit("depth", deep, of="JSON", path=self._path)
        self._at = stop
        return start, self._before + stop, None

    def _listed(self, level: int, *, end: str) -> _Items:
        """Items up to the end mark; for an empty mark, one a line up to the end of the file."""
        items = _Items(self._file)
        if self._take(end) or (not end and not self._mark()):
            return items
        while True:
            items.add(*self._item(level))
            self._counted()
            if self._take(end) or (not end and not self._mark()):
                return items
            if end and not self._take(","):
                raise self._wrong("Expecting ',' delimiter")

    def _object(self, level: int) -> JsonObject:
        items = _Items(self._file)
        names: dict[str, int] = {}
        if self._take("}"):
            return JsonObject(items, names)
        while True:
            names[self._name()] = len(items)
            if not self._take(":"):
                raise self._wrong("Expecting ':' delimiter")
            items.add(*self._item(level))
            self._counted()
            if self._take("}"):
                return JsonObject(items, names)
            if not self._take(","):
                raise self._wrong("Expecting ',' delimiter")

    def _name(self) -> str:
        if self._mark() != '"':
            raise self._wrong("Expecting property name enclosed in double quotes")
        try:
            _, stop = _decoder.raw_decode(self._text, self._at)
        except json.JSONDecodeError as error:
            self._at = error.pos
            raise self._wrong(error.msg) from None
        raw = self._text[self._at : stop].encode("latin-1")
        self._at = stop
        return str(_decoder.decode(raw.decode()))

    def _counted(self) -> None:
        self._count += 1
        if not self._count % _BLOCK:
            check_limit("frames", self._count, of="JSON: items of its large lists", path=self._path)

    def _wrong(self, why: str) -> InputError:
        line = self._lines + self._text.count("\n", 0, self._at) + 1
        newline = self._text.rfind("\n", 0, self._at)
        column = self._before + self._at - (self._before + newline + 1 if newline >= 0 else self._line_at) + 1
        return InputError(f"is not JSON: {why}", path=self._path, line=line, column=column)
