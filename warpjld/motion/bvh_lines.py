"""BVH files as statements with line numbers, independent of how a program breaks lines."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.text_file import text_lines

__all__ = ["NAMED", "BvhLines"]

_COMMENT = re.compile(r"(^|\s)(//|#).*")
"""Comments; ``//`` or ``#`` within a name belongs to the name."""

NAMED = ("ROOT", "JOINT", "END", "ENDSITE")
"""Keywords that are followed by a name, up to the brace."""
_INSIDE = ("OFFSET", "CHANNELS", "MOTION", *NAMED)


class BvhLines:
    """Lines with content, split into words, with line numbers for messages."""

    def __init__(self, path: str | Path) -> None:
        self.path = path
        lines = enumerate(text_lines(path), start=1)
        words = ((number, _COMMENT.sub("", line).replace("\0", "").split()) for number, line in lines)
        self._rest: Iterator[tuple[int, list[str]]] = _statements((n, w) for n, w in words if w)
        self.number = 0

    def next(self, wanted: str) -> list[str]:
        """Words of the next line; InputError, with ``wanted`` as what was expected, at the end of the file."""
        words = self.next_or_none()
        if words is None:
            raise self.error(f"the file ends here; expected {wanted}")
        return words

    def next_or_none(self) -> list[str] | None:
        found = next(self._rest, None)
        if found is None:
            return None
        self.number, words = found
        return words

    def expect(self, keyword: str) -> list[str]:
        """Words after a keyword that the next line must start with."""
        words = self.next(f"'{keyword}'")
        if words[0].lower() != keyword.lower():
            raise self.error(f"expected '{keyword}', not '{words[0]}'")
        return words[1:]

    def setting(self, keyword: str) -> list[str]:
        """Words after a keyword of one or two words and a colon, with or without blanks between them."""
        line = " ".join(self.next(f"'{keyword}:'"))
        found = re.match(rf"{keyword.replace(' ', ' ?')} ?(?::|(?= )) ?", line, re.IGNORECASE)
        if found is None:
            raise self.error(f"want '{keyword}:' and its value, not '{line[:40]}'")
        return line[found.end() :].split()

    def numbers(self, words: list[str], count: int, what: str) -> NDArray[np.float64]:
        """The words as ``count`` finite numbers, shape (count,); ``what`` names them in messages."""
        if len(words) != count:
            raise self.error(f"{what}: want {count} numbers, got {len(words)}")
        try:
            values = np.array(words, dtype=np.float64)
        except ValueError:
            points = [word.rstrip(",;").replace(",", ".") for word in words]  # decimal commas, commas between numbers
            bad = next((word for word, point in zip(words, points, strict=True) if not _is_number(point)), None)
            if bad is not None:
                raise self.error(f"{what}: '{bad}' is not a number") from None
            values = np.array(points, dtype=np.float64)
        if not np.isfinite(values).all():
            raise self.error(f"{what}: '{words[int(np.argmin(np.isfinite(values)))]}' is not finite")
        return values

    def error(self, message: str) -> InputError:
        return InputError(message, path=self.path, line=self.number or None)


def _statements(lines: Iterator[tuple[int, list[str]]]) -> Iterator[tuple[int, list[str]]]:
    """Statements of the hierarchy, one each; lines after MOTION unchanged."""
    for number, words in lines:
        text = " ".join(words)
        if words[0].upper() == "MOTION" and len(words) == 1:
            yield number, words
            break
        for piece in re.split(r"([{}])", text):
            statement: list[str] = []
            for word in piece.split():
                first = statement[0].upper() if statement else ""
                if first == "HIERARCHY" or (first and first not in NAMED and word.upper() in _INSIDE):
                    yield number, statement
                    statement = []
                statement.append(word)
            if statement:
                yield number, statement
    yield from lines


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
