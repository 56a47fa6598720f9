"""Places in a script, for messages."""

from __future__ import annotations

from warpjld.errors import InputError

__all__ = ["Where", "placed"]

Where = tuple[str, int, int]
"""File, line and column of a command, for messages."""


def placed(error: InputError, where: Where | None) -> InputError:
    """The same error at a place in a script, unless it has one."""
    if where is None or error.line is not None:
        return error
    path, line, column = where
    return InputError(str(error), path=path, line=line, column=column)
