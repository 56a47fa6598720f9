"""Conversion of exceptions raised by parsers to an ``InputError`` that names the file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from warpjld.errors import InputError, WarpjldError

__all__ = ["reading"]


@contextmanager
def reading(path: str | Path, kind: str, *, but: type[Exception] | tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Context in which a file is parsed; exceptions of any type are reported as an invalid file.

    It should contain parsing only, so that errors of the program itself are not reported as errors of the file.

    Args:
        path: The file; added to an ``InputError`` without a file.
        kind: File format, for the message: ``OBJ``, ``a glTF 2.0 file``.
        but: Exceptions that are passed on, since the reader handles them.

    Raises:
        InputError: The file cannot be read in this format; the original exception is its cause.
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
    """Message of an exception that can be understood without its traceback."""
    text = str(error).strip().splitlines()[0][:200] if str(error).strip() else ""
    if isinstance(error, KeyError):
        return f"{text} is missing"
    if isinstance(error, ValueError) and "digits" in text and "limit" in text:
        return "a number of thousands of digits"
    return f"{text} ({type(error).__name__})" if text else type(error).__name__
