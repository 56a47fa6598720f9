"""Long blocks of numbers in USD text: where ``TYPE NAME.timeSamples = { … }`` begins, ends, and may be cut.

OpenUSD reads a text as a whole, which takes the text and its values at the same time. A block that holds nothing but
numbers, arrays and tuples of them can be cut between its samples, and its parts be read one after the other. Comments,
strings, paths of assets and blocks with anything else are passed over: they are left as they are.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from warpjld.files.input_file import open_input

__all__ = ["LongSamples", "find_long_samples"]

_READ = 4 << 20  # bytes that are looked at together
_WORD = 4096  # most bytes of a declaration
_GAP = rb"(?:\s++|\#[^\n]*+\n)*+"
_NEXT = re.compile(
    rb"""(?P<text>\#|/\*|\"\"\"|'''|"|'|@@@|@)
    |(?<![\w:.])(?P<declared>(?:(?:custom|uniform|varying|config)\s+)*+[A-Za-z]\w*+(?:\[\])?[ \t]+[^\s=.{}()\[\]"'@\#]+)
     \.timeSamples\s*+=\s*+\{""",
    re.VERBOSE,
)
_ENDS = {
    b"#": re.compile(rb"[^\n]*+\n"),
    b"/*": re.compile(rb"(?:[^*]++|\*(?!/))*+\*/"),
    b'"""': re.compile(rb'(?:[^"\\]++|\\.|"(?!""))*+"""', re.DOTALL),
    b"'''": re.compile(rb"(?:[^'\\]++|\\.|'(?!''))*+'''", re.DOTALL),
    b'"': re.compile(rb'(?:[^"\\\n]++|\\.)*+["\n]', re.DOTALL),
    b"'": re.compile(rb"(?:[^'\\\n]++|\\.)*+['\n]", re.DOTALL),
    b"@@@": re.compile(rb"(?:[^@\\]++|\\(?:@@@)?+|@(?!@@))*+@@@"),
    b"@": re.compile(rb"[^@\n]*+[@\n]"),
}
"""The rest of comments, strings and paths of assets, by what begins them."""
_SAMPLE = re.compile(
    _GAP + rb"[-+\w.]++\s*+:\s*+(?:\[[-+\w.,()\s]*+\]|\((?:[-+\w.,\s]++|\([-+\w.,\s]*+\))*+\)|[-+\w.]++)"
)
_COMMA = re.compile(_GAP + rb",")
_CLOSED = re.compile(_GAP + rb"\}")
_PLAIN = re.compile(rb"(?:[-+\w.,:()\[\]\s]++|\#[^\n]*+\n)*+(?:\#[^\n]*+)?+")
"""What a sample that is cut by the end of what was read consists of."""


@dataclass(frozen=True)
class LongSamples:
    """A block of time samples of numbers.

    Attributes:
        declared: Type and name of the attribute, with its keywords.
        parts: Spans of whole samples, in bytes from the text's beginning: from the opening brace to the closing one.
    """

    declared: bytes
    parts: tuple[tuple[int, int], ...]

    @property
    def span(self) -> tuple[int, int]:
        """From the first sample to the closing brace."""
        return self.parts[0][0], self.parts[-1][1]


def find_long_samples(path: Path, *, least: int, part: int) -> list[LongSamples]:
    """Blocks of numbers in USD text, in the text's order.

    Args:
        path: The text.
        least: Bytes of the shortest block.
        part: Bytes after which a block is cut.

    Raises:
        InputError: It is not a regular file, or cannot be read.
    """
    found = []
    with open_input(path) as file:
        window = _Window(file)
        while (declared := _declared(window)) is not None:
            parts = _parts(window, part)
            if parts and parts[-1][1] - parts[0][0] >= least:
                found.append(LongSamples(declared, parts))
    return found


class _Window:
    """A part of a file: ``data`` begins at byte ``start``, and what comes before ``at`` is not needed any more."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.data, self.start, self.at, self.ended = b"", 0, 0, False

    @property
    def place(self) -> int:
        """Bytes from the file's beginning."""
        return self.start + self.at

    def more(self) -> bool:
        """Read on; whether there was anything."""
        read = b"" if self.ended else self._file.read(max(_READ, len(self.data) - self.at))
        self.ended = not read
        self.data, self.start, self.at = self.data[self.at :] + read, self.place, 0
        return bool(read)


def _declared(window: _Window) -> bytes | None:
    """The next declaration of samples, after whose brace the window then stands; None at the end of the file."""
    while True:
        found = _NEXT.search(window.data, window.at)
        safe = len(window.data) if window.ended else len(window.data) - _WORD
        if found is None or found.start() > safe:
            window.at = max(window.at, safe if found is None else min(found.start(), len(window.data)))
            if not window.more() and found is None:
                return None
        elif found["declared"] is not None:
            window.at = found.end()
            return found["declared"]
        else:
            window.at = found.end()
            if not _passed(window, _ENDS[found["text"]]):
                return None


def _passed(window: _Window, rest: re.Pattern[bytes]) -> bool:
    """Go past the rest of a comment or text; whether it ends."""
    while (found := rest.match(window.data, window.at)) is None:
        if not window.more():
            return False
    window.at = found.end()
    return True


def _parts(window: _Window, most: int) -> tuple[tuple[int, int], ...]:
    """Parts of the block in which the window stands, which is passed; none where it holds other things than numbers."""
    parts, begun = [], window.place
    while _matched(window, _SAMPLE) and _matched(window, _COMMA):
        if window.place - begun >= most:
            parts.append((begun, window.place))
            begun = window.place
    return (*parts, (begun, window.place - 1)) if _matched(window, _CLOSED) else ()


def _matched(window: _Window, pattern: re.Pattern[bytes]) -> bool:
    """Go past what a pattern matches; whether it does."""
    while True:
        found = pattern.match(window.data, window.at)
        if found is not None and (found.end() < len(window.data) or window.ended):
            window.at = found.end()
            return True
        plain = _PLAIN.match(window.data, window.at)
        if window.ended or (found is None and plain is not None and plain.end() < len(window.data)):
            return False
        window.more()
