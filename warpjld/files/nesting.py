"""How deeply brackets of a text lie inside one another, counted before a parser that climbs into them."""

from __future__ import annotations

import numpy as np

__all__ = ["nesting"]

_QUOTE = 2


def nesting(raw: bytes, opening: bytes = b"[{", closing: bytes = b"]}") -> int:
    """The most brackets that are open at once; those inside double quotes do not count.

    Args:
        raw: The text.
        opening: Brackets that open.
        closing: Brackets that close.
    """
    plain = raw.replace(b"\\\\", b"").replace(b'\\"', b"") if b"\\" in raw else raw  # escaped quotes end no text
    marks = opening + closing + b'"'
    step = np.zeros(256, dtype=np.int8)
    step[list(opening)], step[list(closing)], step[ord('"')] = 1, -1, _QUOTE
    steps = step[np.frombuffer(plain.translate(None, bytes(set(range(256)) - set(marks))), dtype=np.uint8)]
    quotes = steps == _QUOTE
    return int(np.cumsum(np.where(quotes | (np.cumsum(quotes) % 2 == 1), 0, steps)).max(initial=0))
