"""Damage that knows what it damages: numbers, JSON and glTF, lines of text, headers of arrays, archives."""

from __future__ import annotations

import io
import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["damaged"]

NUMBERS = (
    *("-1", "0", "1e308", "-1e39", "1e-300", "1e-9", "NaN", "Infinity", "2147483648", "4294967295", "9007199254740993"),
    *("1e9", "1e15", "300000000", "9" * 400, "9" * 5000, '""', "null", "[]", "{}", "²", "٣", "0x10", "1_0", "true"),
)
JUNK: tuple[Any, ...] = (
    *(None, 0, 1, -1, 5, -1.5, 2**31, 2**63, 10**30, 1e300, 1e-300, float("nan"), float("inf"), "", "x", "²", True),
    *([], {}, [1, 2, 3], [[]], {"a": 1}, [None], "a/b", "../../x", "~nobody/x", "\0", "$x", "é" * 200, [0] * 1000),
)
_MOST = 8 << 20
"""Bytes of the largest file that is made: damage after damage may repeat a text a billion times, and limits on time
grow with files."""
_NUMBER = re.compile(rb"(?<![\w.])-?\d+(\.\d+)?([eE][-+]?\d+)?(?![\w.])")


def damaged(data: bytes, draw: random.Random) -> bytes:
    """A file that is no longer what it was, or hardly."""
    ways: list[Callable[[bytes, random.Random], bytes]] = [_bits, _bits, _cut, _lost, _doubled, _number, _number, _deep]
    if data[:4] == b"glTF":
        ways += [_gltf] * 12
    elif data[:1] in b"{[":
        ways += [_json] * 12
    elif data[:4] == b"PK\x03\x04":
        ways += [_archive] * 12
    elif data[:6] == b"\x93NUMPY":
        ways += [_array] * 8
    elif data[:8] == b"PXR-USDC":
        ways += [_count] * 8
    elif b"\n" in data[:200]:
        ways += [_lines, _lines, _words, _words, _words]
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        if data:
            data = draw.choice(ways)(data, draw)[:_MOST]
    return data


def _bits(data: bytes, draw: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(draw.choice((1, 3, 20))):
        out[draw.randrange(len(out))] ^= 1 << draw.randrange(8)
    return bytes(out)


def _cut(data: bytes, draw: random.Random) -> bytes:
    return data[: draw.randrange(len(data))]


def _lost(data: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(data))
    return data[:at] + data[at + draw.choice((1, 4, 50)) :]


def _doubled(data: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(data))
    end = at + draw.choice((1, 4, 50, 1000))
    return data[:end] + data[at:end] * draw.choice((1, 1, 100)) + data[end:]


def _put(data: bytes, draw: random.Random, new: bytes) -> bytes:
    numbers = [match.span() for match in _NUMBER.finditer(data)]
    at = draw.randrange(len(data))
    begin, end = draw.choice(numbers) if numbers else (at, at + 4)
    if data[:4] == b"glTF":  # the chunk's length stays
        new = new[: end - begin].ljust(end - begin)
    return data[:begin] + new + data[end:]


def _number(data: bytes, draw: random.Random) -> bytes:
    return _put(data, draw, draw.choice(NUMBERS).encode())


def _deep(data: bytes, draw: random.Random) -> bytes:
    return _put(data, draw, (draw.choice(("[", "{", '{"a":', "(")) * draw.choice((300, 100_000))).encode())


def _places(content: Any) -> list[tuple[Any, Any]]:
    pairs: list[tuple[Any, Any]] = []
    todo = [content]
    while todo:
        one = todo.pop()
        keys = list(one) if isinstance(one, dict) else range(len(one)) if isinstance(one, list) else ()
        pairs += [(one, key) for key in keys]
        todo += [one[key] for key in keys]
    return pairs


def changed(content: Any, draw: random.Random) -> Any:
    """A JSON value with something else, something less or something more in it."""
    pairs = _places(content)
    if not pairs:
        return draw.choice(JUNK)
    if draw.random() < 0.5:  # near the top, where there are few places
        pairs = [pair for pair in pairs if pair[0] is content] or pairs
    container, key = draw.choice(pairs)
    what = draw.random()
    if what < 0.15:
        del container[key]
    elif what < 0.3:
        container[key] = draw.choice(pairs)[0].__class__()
    elif what < 0.45 and isinstance(container, list):
        container.extend([container[key]] * draw.choice((1, 3, 1000)))
    elif what < 0.6 and isinstance(container[key], int | float):
        value = container[key] if abs(container[key]) < 1e300 else 1
        container[key] = draw.choice((-value, value + 1, value * 2, value * 10**9, value - 1, value / 3, str(value)))
    else:
        container[key] = draw.choice(JUNK)
    return content


def _json(data: bytes, draw: random.Random) -> bytes:
    try:
        content = json.loads(data)
    except (ValueError, RecursionError):
        return _bits(data, draw)
    return json.dumps(changed(content, draw), ensure_ascii=False).encode("utf-8", "surrogatepass")


def _gltf(data: bytes, draw: random.Random) -> bytes:
    """The JSON chunk changed, and the lengths made right again."""
    try:
        size = struct.unpack_from("<I", data, 12)[0]
        content = changed(json.loads(data[20 : 20 + size]), draw)
        raw = json.dumps(content).encode()
    except (ValueError, struct.error, RecursionError):
        return _bits(data, draw)
    raw += b" " * (-len(raw) % 4)
    rest = data[20 + size :]
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(raw) + len(rest), len(raw), 0x4E4F534A) + raw + rest


def _array(data: bytes, draw: random.Random) -> bytes:
    """Another shape or type in the header of a .npy file, or another array."""
    if draw.random() < 0.5:
        lies = ("(300000000000,)", "(0, 0, 3)", "(2, 3)", "(-1,)", "(1,)", "()", "(1000, 1000, 1000)")
        return re.sub(rb"\([\d, ]*\)", draw.choice(lies).encode(), data, count=1)
    if draw.random() < 0.5:
        types = (b"'<f8'", b"'|O'", b"'<U5'", b"'<M8[s]'", b"'|V9'", b"'<c16'", b"'>i2'", b"'<f2'")
        return re.sub(rb"'[<>|=][a-zA-Z]\d+'", draw.choice(types), data, count=1)
    arrays = (np.zeros(0), np.array("x"), np.full((3, 3), np.nan), np.array([1e300]), np.arange(5, dtype=np.uint64))
    out = io.BytesIO()
    np.save(out, draw.choice(arrays))
    return out.getvalue()


def _count(data: bytes, draw: random.Random) -> bytes:
    """Another of the 8-byte numbers by which binary USD states lengths and places."""
    if len(data) < 32:
        return _bits(data, draw)
    for _ in range(100):
        at = draw.randrange(len(data) - 8)
        (value,) = struct.unpack_from("<Q", data, at)
        if 0 < value < 1 << 24:
            break
    value = draw.choice((0, value + 1, value - 1, 1 << 20, 1 << 28, 1 << 30, 1 << 32, 1 << 40, (1 << 64) - 1))
    return data[:at] + struct.pack("<Q", value) + data[at + 8 :]


def _archive(data: bytes, draw: random.Random) -> bytes:
    """A member of a zip archive damaged, gone, doubled or blown up."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            if sum(member.file_size for member in file.infolist()) > 1 << 20:
                return _bits(data, draw)  # blown up already
            members = {name: file.read(name) for name in file.namelist()}
            packing = max((member.compress_type for member in file.infolist()), default=zipfile.ZIP_STORED)
    except Exception:  # damaged already
        return _bits(data, draw)
    if not members:
        return data
    name = draw.choice(list(members))
    what = draw.random()
    if what < 0.1:
        del members[name]
    elif what < 0.2:
        members[name] = members[name][:128] + bytes(1 << draw.choice((20, 26)))
    elif what < 0.3:
        members |= {f"more{k}.npy": members[name] for k in range(draw.choice((3, 200)))}
    elif members[name]:
        members[name] = _member(members[name], draw)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", packing) as file:
        for key, content in members.items():
            file.writestr(key, content)
    return out.getvalue()


def _member(data: bytes, draw: random.Random) -> bytes:
    if data[:6] == b"\x93NUMPY":
        return draw.choice((_array, _array, _bits, _cut))(data, draw)
    if data[:8] == b"PXR-USDC":
        return draw.choice((_count, _count, _bits, _cut))(data, draw)
    if data[:1] == b"{":
        return draw.choice((_json, _json, _json, _number, _bits, _cut))(data, draw)
    return draw.choice((_number, _words, _words, _bits, _cut, _doubled))(data, draw)


def _lines(data: bytes, draw: random.Random) -> bytes:
    lines = data.split(b"\n")
    a, b = draw.randrange(len(lines)), draw.randrange(len(lines))
    what = draw.random()
    if what < 0.3:
        del lines[a]
    elif what < 0.6:
        lines[a], lines[b] = lines[b], lines[a]
    elif what < 0.8:
        lines[a:a] = [lines[b]] * draw.choice((1, 20, 2000))
    else:
        lines[a] = lines[a] + b" " + lines[b]
    return b"\n".join(lines)


def _words(data: bytes, draw: random.Random) -> bytes:
    words = re.split(rb"([\s,=]+)", data)
    a, b = 2 * draw.randrange((len(words) + 1) // 2), 2 * draw.randrange((len(words) + 1) // 2)
    junk = [str(one).encode("utf-8", "surrogatepass") for one in (*NUMBERS, *JUNK)]
    words[a] = draw.choice((words[b], draw.choice(junk), b"", b'"' + draw.choice(junk) + b'"'))
    return b"".join(words)
