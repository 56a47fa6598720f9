"""Strict reading of TOML files: values are validated, and unknown keys are errors."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

from warpjld.errors import InputError
from warpjld.files.reading import reading
from warpjld.files.text_file import read_text
from warpjld.limits import check_limit
from warpjld.suggest import did_you_mean

__all__ = ["TomlTable", "read_toml"]


def read_toml(path: str | Path) -> TomlTable:
    """Read the top-level table of a TOML file.

    Raises:
        InputError: The file cannot be read, or is not TOML.
    """
    text = read_text(path)
    try:
        with reading(path, "TOML", but=tomllib.TOMLDecodeError):
            content = _loaded(text)
    except tomllib.TOMLDecodeError as error:
        found = re.search(r"\(at line (\d+), column (\d+)\)", str(error))
        line, column = (int(found[1]), int(found[2])) if found else (None, None)
        message = re.sub(r" \(at .*\)$", "", str(error))
        raise InputError(f"not TOML: {message}", path=path, line=line, column=column) from error
    return TomlTable(content, "", Path(path), text.splitlines())


def _loaded(text: str) -> dict[str, Any]:
    """Content of a TOML text; integers beyond 64 bits are read as floats, infinite if out of their range."""
    content: dict[str, Any] = _plain(tomllib.loads(text))
    return content


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_plain(inner) for inner in value]
    if isinstance(value, int) and abs(value) >= 2**63:
        return float(value) if abs(value) < 2**1000 else math.inf if value > 0 else -math.inf
    return value


def _short(value: Any) -> str:
    """Shortened form of a value for messages."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}…"


class TomlTable:
    """A table whose keys are read one by one; `finish` rejects keys that were not read."""

    def __init__(self, content: dict[str, Any], name: str, path: Path, lines: Sequence[str]) -> None:
        self._content, self._name, self._path, self._lines = content, name, path, lines
        self._asked: list[str] = []

    def __contains__(self, key: str) -> bool:
        return key in self._content

    def __iter__(self) -> Iterator[str]:
        """Keys in the order of the file."""
        return iter(self._content)

    def is_table(self, key: str) -> bool:
        """Whether a key exists and its value is a table."""
        return isinstance(self._content.get(key), dict)

    @property
    def name(self) -> str:
        """Dotted path of the table from the top of the file."""
        return self._name

    @property
    def file(self) -> Path:
        """The file."""
        return self._path

    @property
    def folder(self) -> Path:
        """Folder of the file, to which paths in it are relative."""
        return self._path.parent

    def fail(self, key: str, message: str) -> NoReturn:
        """Raise InputError about a key, with the line in which it is probably."""
        raise InputError(f"{self._called(key)}: {message}", path=self._path, line=self._line(key))

    def needed(self, *keys: str) -> None:
        """Raise InputError if one of these keys is missing or misspelt."""
        for key in keys:
            if key not in self._content:
                for other in self._content:
                    if other not in self._asked and other not in keys and (hint := did_you_mean(other, [key])):
                        self.fail(other, f"unknown key{hint}")
                self.fail(key, "is missing")

    def text(self, key: str, default: str | None = None, *, known: Sequence[str] = ()) -> str | None:
        """A string, one of ``known`` if given."""
        value = self._take(key, default)
        if value is None:
            return None
        if not isinstance(value, str):
            self.fail(key, f"want text, got {_short(value)}")
        if known and value not in known:
            self.fail(key, f"want one of {', '.join(known)}, got '{value}'{did_you_mean(value, known)}")
        return value

    def truth(self, key: str, default: bool) -> bool:
        """A boolean."""
        value = self._take(key, default)
        if not isinstance(value, bool):
            self.fail(key, f"want true or false, got {_short(value)}")
        return value

    def integer(self, key: str, default: int | None = None, *, least: int = 0, within: str | None = None) -> int:
        """An integer, required if there is no default; ``within`` names a limit that it must not exceed."""
        if default is None:
            self.needed(key)
        value = self._take(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or value < least:
            self.fail(key, f"want a whole number from {least} on, got {_short(value)}")
        if within is not None:
            try:
                check_limit(within, value)
            except InputError as error:
                self.fail(key, error.message)
        return value

    def number(
        self, key: str, default: float | None = None, *, above: float = -math.inf, least: float = -math.inf,
        most: float = math.inf,
    ) -> float | None:  # fmt: skip
        """A finite number in range; None if it is missing and has no default."""
        value = self._take(key, default)
        return None if value is None else self._number(key, value, above, least, most)

    def numbers(
        self, key: str, default: Sequence[float], *, above: float = -math.inf, least: float = -math.inf,
        most: float = math.inf, count: int | None = None,
    ) -> tuple[float, ...]:  # fmt: skip
        """Finite numbers in range; a single number is read as a list of one."""
        value = self._take(key, list(default))
        items = value if isinstance(value, list) else [value]
        if not items or (count is not None and len(items) != count):
            self.fail(key, f"want {count or 'one or more'} numbers, got {_short(value)}")
        return tuple(self._number(key, item, above, least, most) for item in items)

    def vector(self, key: str, default: Sequence[float] = ()) -> tuple[float, float, float]:
        """Three finite numbers."""
        x, y, z = self.numbers(key, default, count=3)
        return x, y, z

    def like(self, key: str, default: object) -> Any:
        """A value of the same type as its default; for a default of None, an optional integer."""
        if key not in self._content:
            self._asked.append(key)
            return default
        if isinstance(default, bool):
            return self.truth(key, default)
        if default is None or isinstance(default, int):
            return self.integer(key)
        if isinstance(default, float):
            return self.number(key)
        if isinstance(default, str):
            return self.text(key)
        self.numbers(key, ())
        value = self._content[key]
        return tuple(value) if isinstance(value, list) else (value,)

    def texts(self, key: str, default: Sequence[str], *, known: Sequence[str]) -> tuple[str, ...]:
        """One or more distinct strings out of ``known``."""
        value = self._take(key, list(default))
        if not isinstance(value, list) or not value or not all(isinstance(item, str) for item in value):
            self.fail(key, f"want a list of names, got {_short(value)}")
        for item in value:
            if item not in known:
                self.fail(key, f"want some of {', '.join(known)}, got '{item}'{did_you_mean(item, known)}")
        if len(set(value)) != len(value):
            self.fail(key, f"names one twice: {_short(value)}")
        return tuple(value)

    def table(self, key: str) -> TomlTable:
        """A table; empty if it is missing."""
        value = self._take(key, {})
        if not isinstance(value, dict):
            self.fail(key, f"want a table [{self._called(key)}], got {_short(value)}")
        return TomlTable(value, self._called(key), self._path, self._lines)

    def named_tables(self, key: str) -> dict[str, TomlTable]:
        """Tables ``[key.NAME]`` by name; empty if the key is missing."""
        table = self.table(key)
        return {name: table.table(name) for name in table}

    def tables(self, key: str, *, least: int = 1) -> list[TomlTable]:
        """Tables ``[[key]]``, at least ``least`` of them."""
        value = self._take(key, [])
        if not isinstance(value, list) or len(value) < least or not all(isinstance(item, dict) for item in value):
            self.fail(key, f"want one or more tables [[{self._called(key)}]]")
        return [TomlTable(v, f"{self._called(key)}[{k}]", self._path, self._lines) for k, v in enumerate(value)]

    def finish(self, known: Sequence[str] = ()) -> None:
        """Raise InputError if a key was not read: it is misspelt, or in the wrong table.

        Args:
            known: Further keys that may be suggested.
        """
        for key in self._content:
            if key not in self._asked:
                names = list(dict.fromkeys([*self._asked, *known]))
                hint = did_you_mean(key, names) or f"; known: {', '.join(names)}"
                self.fail(key, f"unknown key{hint}")

    def _take(self, key: str, default: Any) -> Any:
        self._asked.append(key)
        return self._content.get(key, default)

    def _number(self, key: str, value: Any, above: float, least: float, most: float) -> float:
        if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
            self.fail(key, f"want a finite number, got {_short(value)}")
        if value <= above or not least <= value <= most:
            wanted = [f"above {above:g}"] * (above > -math.inf) + [f"from {least:g} on"] * (least > -math.inf)
            wanted += [f"up to {most:g}"] * (most < math.inf)
            self.fail(key, f"want a number {' and '.join(wanted)}, got {_short(value)}")
        return float(value)

    def _called(self, key: str) -> str:
        return f"{self._name}.{key}" if self._name else key

    def _line(self, key: str) -> int | None:
        """Line number of a key; for repeated tables, in the k-th one. None if not found."""
        header = re.sub(r"\[\d+\]", "", self._name)
        skip = [int(n) for n in re.findall(r"\[(\d+)\]", self._name)]
        current, seen = "", -1
        for number, line in enumerate(self._lines, 1):
            opened = re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line)
            if opened:
                current = opened[1]
                seen += current == header
                if current == (f"{header}.{key}" if header else key):
                    return number
            elif (
                current == header
                and (not skip or seen == skip[-1])
                and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*[.=]", line)
            ):
                return number
        return None
