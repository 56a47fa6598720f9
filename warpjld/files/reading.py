"""The boundary around parsers: whatever one raises becomes an ``InputError`` that names the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from warpjld.errors import InputError, WarpjldError

__all__ = ["reading"]


@contextmanager
def reading(path: str | Path, kind: str, *, but: type[Exception] | tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """While the statement lasts a file is read: its content may be anything, and libraries raise anything at it.

    Only what turns bytes into values belongs inside, so that a fault of the program's own is not taken for the file's.

    Args:
        path: The file; put into those errors that name none.
        kind: What it is read as, for the message: ``OBJ``, ``a glTF 2.0 file``.
        but: What is left as it is, since the reader tells it better.

    Raises:
        InputError: The file cannot be read as that; the first error is its cause.
    """
    try:
        yield
    except InputError as error:
        if error.path is not None:
            raise
        raise InputError(error.message, path=path, line=error.line, column=error.column) from error
    except WarpjldError:
        raise
    except but:
        raise
    except RecursionError as error:
        raise InputError(f"cannot be read as {kind}: nested too deeply", path=path) from error
    except MemoryError as error:
        raise InputError(f"cannot be read as {kind}: not enough memory for what it announces", path=path) from error
    except OSError as error:
        raise InputError(f"cannot be read as {kind}: {error.strerror or error}", path=path) from error
    except Exception as error:
        raise InputError(f"cannot be read as {kind}: {_said(error)}", path=path) from error


def _said(error: Exception) -> str:
    """What an exception says, told so that it means something without its traceback."""
    text = str(error).strip().splitlines()[0][:200] if str(error).strip() else ""
    if isinstance(error, KeyError):
        return f"{text} is missing"
    if isinstance(error, ValueError) and "digits" in text and "limit" in text:
        return "a number of thousands of digits"
    return f"{text} ({type(error).__name__})" if text else type(error).__name__
