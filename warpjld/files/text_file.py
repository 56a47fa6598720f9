"""Reading files that people write: UTF-8 text, and JSON."""

from __future__ import annotations

import codecs
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

from warpjld.errors import InputError
from warpjld.files.input_file import open_input, read_bytes
from warpjld.files.nesting import nesting
from warpjld.limits import check_limit

__all__ = ["parse_json", "read_json", "read_text", "text_lines"]


def read_text(path: str | Path, *, errors: Literal["strict", "replace"] = "strict") -> str:
    """All of a UTF-8 file with ``\\n`` as its ends of lines, without the byte order mark that some editors put first.

    UTF-16 is read where a byte order mark says so, as Windows PowerShell writes it.

    Args:
        path: The file.
        errors: ``replace`` where the text may hold names in other encodings.

    Raises:
        InputError: It cannot be read, or is no such text.
    """
    raw = read_bytes(path)
    try:
        wide = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = raw.decode("utf-16" if wide else "utf-8-sig", errors)
    except UnicodeDecodeError as error:
        kind = "UTF-16" if wide else "UTF-8"
        raise InputError(f"is not {kind} text (byte {error.start})", path=path) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def text_lines(path: str | Path) -> Iterator[str]:
    """Iterate over the lines of a text file, decoded as by ``read_text``; invalid bytes are replaced.

    Raises:
        InputError: It cannot be read.
    """
    with open_input(path) as raw:
        wide = raw.peek(2)[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)  # type: ignore[attr-defined]
        with io.TextIOWrapper(raw, "utf-16" if wide else "utf-8-sig", errors="replace", newline=None) as text:
            try:
                for line in text:
                    yield line.removesuffix("\n")
            except OSError as error:
                raise InputError(f"cannot be read: {error.strerror}", path=path) from None


def read_json(path: str | Path) -> Any:
    """What a JSON file holds; integers beyond 64 bits are floats, infinite ones where they have endless digits.

    Raises:
        InputError: It cannot be read, or is not JSON: names line and column.
    """
    return parse_json(read_text(path), path)


def parse_json(text: str, path: str | Path) -> Any:
    """What a JSON text of a file holds; raises as ``read_json``."""
    check_limit("depth", nesting(text.encode("utf-8", "replace")), of="JSON", path=path)
    try:
        return json.loads(text, parse_int=_integer)
    except json.JSONDecodeError as error:
        raise InputError(f"is not JSON: {error.msg}", path=path, line=error.lineno, column=error.colno) from None
    except RecursionError:  # where the limit was raised beyond what Python's reader takes
        raise InputError("is not read: its JSON is nested more deeply than Python takes", path=path) from None


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) < 19 else float(digits)
