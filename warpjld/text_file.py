"""Reading files that people write: UTF-8 text, and JSON."""

from __future__ import annotations

import codecs
import json
from pathlib import Path
from typing import Any, Literal

from warpjld.errors import InputError

__all__ = ["read_json", "read_text"]


def read_text(path: str | Path, *, errors: Literal["strict", "replace"] = "strict") -> str:
    """All of a UTF-8 file with ``\\n`` as its ends of lines, without the byte order mark that some editors put first.

    UTF-16 is read where a byte order mark says so, as Windows PowerShell writes it.

    Args:
        path: The file.
        errors: ``replace`` where the text may hold names in other encodings.

    Raises:
        InputError: It cannot be read, or is no such text.
    """
    try:
        raw = Path(path).read_bytes()
        wide = raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = raw.decode("utf-16" if wide else "utf-8-sig", errors)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    except UnicodeDecodeError as error:
        kind = "UTF-16" if wide else "UTF-8"
        raise InputError(f"is not {kind} text (byte {error.start})", path=path) from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_json(path: str | Path) -> Any:
    """What a JSON file holds; integers beyond 64 bits are floats, infinite ones where they have endless digits.

    Raises:
        InputError: It cannot be read, or is not JSON: names line and column.
    """
    try:
        return json.loads(read_text(path), parse_int=_integer)
    except json.JSONDecodeError as error:
        raise InputError(f"is not JSON: {error.msg}", path=path, line=error.lineno, column=error.colno) from None
    except RecursionError:
        raise InputError("is nested too deeply", path=path) from None


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) < 19 else float(digits)
