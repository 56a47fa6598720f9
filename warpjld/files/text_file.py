"""Reading of text files (UTF-8 or UTF-16) and JSON."""

from __future__ import annotations

import codecs
import io
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

from warpjld.errors import InputError
from warpjld.files.input_file import open_input, read_bytes
from warpjld.files.nesting import nesting
from warpjld.limits import check_limit

__all__ = ["json_integer", "parse_json", "read_json", "read_text", "text_lines"]


def read_text(path: str | Path, *, errors: Literal["strict", "replace"] = "strict") -> str:
    """Content of a UTF-8 text file, with line ends ``\\n`` and without a byte order mark.

    A UTF-16 byte order mark, as written by Windows PowerShell, selects UTF-16.

    Args:
        path: The file.
        errors: ``replace`` for files that may have names in other encodings.

    Raises:
        InputError: The file cannot be read, or is not text in this encoding.
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
        InputError: The file cannot be read.
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
    """Content of a JSON file; integers beyond 64 bits are read as floats, infinite if out of their range.

    Raises:
        InputError: The file cannot be read, or is not JSON; names line and column. Or it exceeds ``json-bytes``, since
            as Python objects it takes several times as much memory.
    """
    with open_input(path) as file:
        size = os.fstat(file.fileno()).st_size
    check_limit("json-bytes", size, of="JSON", path=path)
    return parse_json(read_text(path), path)


def parse_json(text: str, path: str | Path) -> Any:
    """Content of the JSON text of a file; raises as ``read_json``."""
    check_limit("depth", nesting(text.encode("utf-8", "replace")), of="JSON", path=path)
    try:
        return json.loads(text, parse_int=json_integer)
    except json.JSONDecodeError as error:
        raise InputError(f"is not JSON: {error.msg}", path=path, line=error.lineno, column=error.colno) from None
    except RecursionError:  # possible if the limit is raised beyond that of Python's parser
        raise InputError("is not read: its JSON is nested more deeply than Python takes", path=path) from None


def json_integer(digits: str) -> int | float:
    """An integer of a JSON text; a float beyond 64 bits."""
    return int(digits) if len(digits) < 19 else float(digits)
