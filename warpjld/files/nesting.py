"""Nesting depth of brackets in a text, checked before it is given to a recursive parser."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

__all__ = ["nesting"]

_QUOTE = 2  # code of a quotation mark; brackets have +1 and -1
_BLOCK = 1 << 20  # bytes looked at together, which bounds memory


def nesting(text: bytes | Iterable[bytes], opening: bytes = b"[{", closing: bytes = b"]}") -> int:
    """Largest nesting depth of brackets, not counting those inside double quotes.

    Args:
        text: The text, or pieces of it.
        opening: Opening brackets.
        closing: Closing brackets.
    """
    others = bytes(set(range(256)) - set(opening + closing + b'"'))
    step = np.zeros(256, dtype=np.int8)
    step[list(opening)], step[list(closing)], step[ord('"')] = 1, -1, _QUOTE
    depth = deepest = quoted = 0
    for plain in _without_escapes(_blocks(text)):
        steps = step[np.frombuffer(plain.translate(None, others), dtype=np.uint8)]
        if not steps.size:
            continue
        quotes = steps == _QUOTE
        inside = (np.cumsum(quotes) + quoted) % 2 == 1
        depths = depth + np.cumsum(np.where(quotes | inside, 0, steps))
        depth, deepest, quoted = int(depths[-1]), max(deepest, int(depths.max())), int(inside[-1])
    return deepest


def _blocks(text: bytes | Iterable[bytes]) -> Iterable[bytes]:
    if isinstance(text, bytes):
        return (text[start : start + _BLOCK] for start in range(0, len(text), _BLOCK))
    return text


def _without_escapes(blocks: Iterable[bytes]) -> Iterable[bytes]:
    """The blocks without escaped quotes, which end no string. A backslash that ends a block is left to the next one."""
    left = b""
    for block in blocks:
        whole, left = left + block, b""
        if b"\\" in whole:
            plain = whole.replace(b"\\\\", b"")
            if plain.endswith(b"\\"):
                plain, left = plain[:-1], b"\\"
            whole = plain.replace(b'\\"', b"")
        yield whole
