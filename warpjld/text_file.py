"""Reading files that people write: UTF-8 text, and JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from warpjld.errors import InputError

__all__ = ["read_json", "read_text"]


def read_text(path: str | Path) -> str:
    """All of a UTF-8 file, without the byte order mark that some editors put first.

    Raises:
        InputError: It cannot be read, or is no such text.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    except UnicodeDecodeError as error:
        raise InputError(f"is not UTF-8 text (byte {error.start})", path=path) from None


def read_json(path: str | Path) -> Any:
    """What a JSON file holds.

    Raises:
        InputError: It cannot be read, or is not JSON: names line and column.
    """
    try:
        return json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise InputError(f"is not JSON: {error.msg}", path=path, line=error.lineno, column=error.colno) from None
    except RecursionError:
        raise InputError("is nested too deeply", path=path) from None
