"""Nesting depth of brackets in a text, checked before it is given to a recursive parser."""

from __future__ import annotations

import numpy as np

__all__ = ["nesting"]

_QUOTE = 2  # code of a quotation mark; brackets have +1 and -1


def nesting(raw: bytes, opening: bytes = b"[{", closing: bytes = b"]}") -> int:
    """Largest nesting depth of brackets, not counting those inside double quotes.

    Args:
        raw: The text.
        opening: Opening brackets.
        closing: Closing brackets.
    """
    plain = raw.replace(b"\\\\", b"").replace(b'\\"', b"") if b"\\" in raw else raw  # escaped quotes end no string
    marks = opening + closing + b'"'
    step = np.zeros(256, dtype=np.int8)
    step[list(opening)], step[list(closing)], step[ord('"')] = 1, -1, _QUOTE
    steps = step[np.frombuffer(plain.translate(None, bytes(set(range(256)) - set(marks))), dtype=np.uint8)]
    quotes = steps == _QUOTE
    return int(np.cumsum(np.where(quotes | (np.cumsum(quotes) % 2 == 1), 0, steps)).max(initial=0))
