"""USD text with long animations, parsed in parts: memory is that of its values, not also that of its text."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.input_file import open_input
from warpjld.io.usd.long_samples import LongSamples, find_long_samples

__all__ = ["layer_in_parts"]

_LONG = 16 << 20  # bytes of a text from which on it is parsed in parts
_LEAST = 1 << 20  # bytes of the shortest block of samples that is taken out of the text
_PART = 8 << 20  # bytes of a part
_HEAD = re.compile(rb"#usda [\d.]+")
_MARK = -(2.0**52)
"""Time code of the first block's stand-in. Time codes of animations are far from it."""


def layer_in_parts(
    path: Path, *, samples: bool = True, long: int = _LONG, least: int = _LEAST, part: int = _PART
) -> Any | None:
    """The layer of a long text, parsed in parts; None where OpenUSD has to read it as a whole.

    That is so for short texts, those that consist of other things than long blocks of numbers, and damaged ones, whose
    errors it tells better.

    Args:
        path: A USD file.
        samples: Whether the long blocks are read, or left out.
        long: Bytes of the shortest text.
        least: Bytes of the shortest block of samples.
        part: Bytes after which a block is cut.

    Returns:
        A ``Sdf.Layer`` with the file's name.
    """
    from pxr import Sdf, Tf

    with open_input(path) as file:
        head = _HEAD.match(file.read(20))
    if head is None or path.stat().st_size < long:
        return None
    blocks = find_long_samples(path, least=least, part=part)
    if sum(block.span[1] - block.span[0] for block in blocks) < path.stat().st_size / 2:
        return None
    try:
        layer = Sdf.Layer.New(Sdf.FileFormat.FindById("usda"), str(path.absolute()))
        with Sdf.ChangeBlock():
            _fill(layer, path, head[0], blocks, samples)
    except (InputError, UnicodeDecodeError, ValueError, Tf.ErrorException):
        return None
    return layer


def _fill(layer: Any, path: Path, head: bytes, blocks: list[LongSamples], samples: bool) -> None:
    with path.open("rb") as file:

        def text(start: int, end: int) -> bytes:
            file.seek(start)
            return file.read(end - start)

        rest, at = [], 0
        for k, block in enumerate(blocks):
            start, end = block.span
            rest += [text(at, start), b" %d: None " % (_MARK - k)]
            at = end
        _parse(layer, b"".join([*rest, text(at, path.stat().st_size)]))
        for attribute, block in zip(_marked(layer, len(blocks)), blocks, strict=True):
            layer.EraseTimeSample(attribute, layer.ListTimeSamplesForPath(attribute)[0])
            for part in block.parts if samples else ():
                numbers = b"%s.timeSamples = {%s}" % (block.declared, text(*part))
                _copy(layer, attribute, b'%s\ndef "a"\n{\n%s\n}\n' % (head, numbers))


def _marked(layer: Any, count: int) -> list[Any]:
    """Paths of the attributes that have stand-ins, in the blocks' order.

    Raises:
        ValueError: Some block has none, as where an attribute is stated twice.
    """
    found: dict[float, Any] = {}

    def look(path: Any) -> None:
        if path.IsPropertyPath() and layer.GetNumTimeSamplesForPath(path) == 1:
            found[layer.ListTimeSamplesForPath(path)[0]] = path

    layer.Traverse("/", look)
    paths = [found.get(_MARK - k) for k in range(count)]
    if None in paths:
        raise ValueError("a block of samples belongs to no attribute")
    return paths


def _copy(layer: Any, attribute: Any, text: bytes) -> None:
    """Copy the samples of a text's only attribute."""
    from pxr import Sdf

    part = Sdf.Layer.CreateAnonymous(".usda")
    _parse(part, text)
    (spec,) = part.GetPrimAtPath("/a").attributes
    for code in part.ListTimeSamplesForPath(spec.path):
        layer.SetTimeSample(attribute, code, part.QueryTimeSample(spec.path, code))


def _parse(layer: Any, text: bytes) -> None:
    if not layer.ImportFromString(text.decode()):
        raise ValueError("no USD text")
