"""Everything warpjld raises on purpose. The command line prints these as one line, without a traceback."""

from __future__ import annotations

from pathlib import Path

__all__ = ["InputError", "MissingExtraError", "WarpjldError"]


_LONGEST = 1000
"""Characters of a message: whoever reads more reads the file itself."""


class WarpjldError(Exception):
    """Base of all errors raised on purpose.

    Examples:
        >>> try:
        ...     wj.load_rig("missing.glb")
        ... except wj.WarpjldError as error:
        ...     print(error)
        missing.glb: no such file
    """


class InputError(WarpjldError):
    """Something given by the user cannot be used: names the place and what was expected.

    Args:
        message: What is wrong and what was expected.
        path: The file concerned, if any.
        line: 1-based line in that file.
        column: 1-based column in that line.

    Examples:
        >>> try:
        ...     wj.build_hand("left", length=19.0)
        ... except wj.InputError as error:
        ...     print(error.message)
        length: want metres...
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
    ) -> None:
        if len(message) > _LONGEST:  # it cites what a file holds
            message = f"{message[: _LONGEST // 2]} … {message[-_LONGEST // 4 :]}"
        self.message = message
        self.path = None if path is None else Path(path)
        self.line = line
        self.column = column
        place = ":".join(str(part) for part in (path, line, column) if part is not None)
        super().__init__(f"{place}: {message}" if place else message)


class MissingExtraError(WarpjldError):
    """An optional dependency is not installed: names the extra that brings it.

    Examples:
        >>> print(wj.MissingExtraError("reading FBX files", "fbx"))
        reading FBX files needs an optional dependency: pip install 'warpjld[fbx]'
    """

    def __init__(self, purpose: str, extra: str) -> None:
        super().__init__(f"{purpose} needs an optional dependency: pip install 'warpjld[{extra}]'")
