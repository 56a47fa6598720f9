"""Reader of PLY that keeps every vertex in the file's order, and polygons of any number of corners.

Own parser: trimesh splits vertices at texture seams, triangulates concave polygons wrongly and rejects binary files
that mix triangles with quads; VTK reads memory beyond the end of a damaged file.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["PlyFile", "read_ply"]

_NAMES = (
    ("i1", "char", "int8"),
    ("u1", "uchar", "uint8"),
    ("i2", "short", "int16"),
    ("u2", "ushort", "uint16"),
    ("i4", "int", "int32"),
    ("u4", "uint", "uint32"),
    ("f4", "float", "float32"),
    ("f8", "double", "float64"),
)
_KINDS = {name: kind for kind, *names in _NAMES for name in names}
_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TEXTURES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
_INDICES = ("vertex_indices", "vertex_index")
_HEADER = 1 << 20  # bytes of the longest header; its lines take several times as much memory


@dataclass(frozen=True, eq=False)
class PlyFile:
    """The polygons of a PLY file.

    Attributes:
        vertices: Positions, shape (W, 3).
        counts: Number of corners of every polygon, shape (P,).
        corners: Vertex indices of all polygons' corners, shape (C,).
        uv: Texture coordinates of the vertices, shape (W, 2), or None.
        corner_uv: Texture coordinates of the polygons' corners, shape (C, 2), or None.
    """

    vertices: NDArray[np.float64]
    counts: NDArray[np.int64]
    corners: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    corner_uv: NDArray[np.float32] | None


@dataclass
class _Element:
    """A type of rows: properties by name, as type of the list's length ("" for a scalar) and type of the values."""

    name: str
    count: int
    properties: dict[str, tuple[str, str]] = field(default_factory=dict)


_Column = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Values of a property of all rows, and the number of values of each row."""


def read_ply(path: str | Path) -> PlyFile:
    """Read a PLY file, text or binary.

    Raises:
        InputError: It cannot be read, or its body does not match its header.
    """
    path = Path(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    order, elements, start = _header(raw, path)
    body: _Text | _Binary = _Binary(raw, start, order) if order else _Text(raw[start:])
    found: dict[str, dict[str, _Column]] = {}
    for element in elements:
        try:
            found[element.name] = body.read(element)
        except (ValueError, struct.error, OverflowError, IndexError):
            raise InputError(
                f"is damaged: its body does not hold the {element.count} of element '{element.name}' it announces",
                path=path,
            ) from None
    return _assembled(found, path)


def _header(raw: bytes, path: Path) -> tuple[str, list[_Element], int]:
    """Byte order ("" for text), elements, and offset of the body."""
    end = raw.find(b"end_header", 0, _HEADER)
    if not raw.startswith(b"ply") or end < 0:
        raise InputError(
            f"is no PLY file: want a header from 'ply' to 'end_header' of at most {_HEADER >> 20} MiB", path=path
        )
    start = end + len(b"end_header")
    start += 2 if raw[start : start + 2] == b"\r\n" else 1
    order, elements = None, []
    lines = raw[:end].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(lines, 1):
        match line.split():
            case ["format", kind, _] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, count] if count.isdecimal() and len(count) < 12:
                elements.append(_Element(name, int(count)))
            case ["property", "list", many, kind, name] if elements and many in _KINDS and kind in _KINDS:
                elements[-1].properties[name] = _KINDS[many], _KINDS[kind]
            case ["property", kind, name] if elements and kind in _KINDS:
                elements[-1].properties[name] = "", _KINDS[kind]
            case [] | ["ply"] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise InputError(f"header line not understood: '{line[:60]}'", path=path, line=number)
    if order is None:
        raise InputError("its header does not say its format", path=path)
    return order, elements, start


class _Text:
    """Rows as lines of numbers."""

    def __init__(self, body: bytes) -> None:
        lines = body.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")
        self._lines = [line for line in lines if line.strip()]
        self._next = 0

    def read(self, element: _Element) -> dict[str, _Column]:
        lines = self._lines[self._next : self._next + element.count]
        if len(lines) < element.count:
            raise ValueError("too few lines")
        self._next += element.count
        values: dict[str, list[float]] = {name: [] for name in element.properties}
        counts: dict[str, list[int]] = {name: [] for name in element.properties}
        for line in lines:
            numbers, at = [float(word) for word in line.split()], 0
            for name, (many, _) in element.properties.items():
                count = 1
                if many:
                    count, at = int(numbers[at]), at + 1
                if count < 0 or at + count > len(numbers):
                    raise ValueError("too few numbers")
                values[name] += numbers[at : at + count]
                counts[name].append(count)
                at += count
        return {name: (np.array(values[name], float), np.array(counts[name], np.int64)) for name in values}


class _Binary:
    """Rows as packed numbers."""

    def __init__(self, raw: bytes, start: int, order: str) -> None:
        self._raw, self._at, self._order = raw, start, order

    def read(self, element: _Element) -> dict[str, _Column]:
        smallest = sum(np.dtype(many or kind).itemsize for many, kind in element.properties.values())
        if element.count * smallest > len(self._raw) - self._at:
            raise ValueError("too few bytes")
        if not element.count:
            return {name: (np.zeros(0), np.zeros(0, np.int64)) for name in element.properties}
        same = self._as_table(element)
        return self._row_by_row(element) if same is None else same

    def _as_table(self, element: _Element) -> dict[str, _Column] | None:
        """All rows at once if all lists have the same lengths as the first row's, else None."""
        fields: list[tuple[str, str, tuple[int, ...]]] = []
        long, at = {}, self._at
        for name, (many, kind) in element.properties.items():
            long[name] = 1
            if many:
                (count,) = struct.unpack_from(self._order + _CODES[many], self._raw, at)
                long[name] = int(count)
                fields.append((f"{name} count", self._order + many, ()))
                at += np.dtype(many).itemsize
            if not 0 <= long[name] <= len(self._raw):
                raise ValueError("too few bytes")
            fields.append((name, self._order + kind, (long[name],)))
            at += long[name] * np.dtype(kind).itemsize
        row = np.dtype(fields)
        if row.itemsize * element.count > len(self._raw) - self._at:
            return None
        table = np.frombuffer(self._raw, row, element.count, self._at)
        if any((table[f"{name} count"] != long[name]).any() for name, (many, _) in element.properties.items() if many):
            return None
        self._at += row.itemsize * element.count
        counts = {name: np.full(element.count, long[name], np.int64) for name in long}
        return {name: (table[name].astype(np.float64).ravel(), counts[name]) for name in long}

    def _row_by_row(self, element: _Element) -> dict[str, _Column]:
        values: dict[str, list[float]] = {name: [] for name in element.properties}
        counts: dict[str, list[int]] = {name: [] for name in element.properties}
        at = self._at
        for _ in range(element.count):
            for name, (many, kind) in element.properties.items():
                count = 1
                if many:
                    (count,) = struct.unpack_from(self._order + _CODES[many], self._raw, at)
                    count, at = int(count), at + np.dtype(many).itemsize
                width = np.dtype(kind).itemsize
                if not 0 <= count * width <= len(self._raw) - at:
                    raise ValueError("too few bytes")
                values[name] += struct.unpack_from(f"{self._order}{count}{_CODES[kind]}", self._raw, at)
                counts[name].append(count)
                at += count * width
        self._at = at
        return {name: (np.array(values[name], float), np.array(counts[name], np.int64)) for name in values}


def _assembled(found: dict[str, dict[str, _Column]], path: Path) -> PlyFile:
    vertex, face = found.get("vertex", {}), found.get("face", {})
    if not {"x", "y", "z"} <= vertex.keys():
        raise InputError("has no vertices with x, y and z", path=path)
    index = next((name for name in _INDICES if name in face), None)
    if index is None:
        raise InputError("has no triangles", path=path)
    vertices = np.stack([vertex[axis][0] for axis in "xyz"], axis=1)
    numbers, counts = face[index]
    corners = numbers.astype(np.int64)
    bad = np.flatnonzero((corners < 0) | (corners >= len(vertices)) | (corners != numbers))
    if len(bad):
        said = f"there is no vertex {numbers[bad[0]]:g}: the file has {len(vertices)}, counted from 0"
        raise InputError(said, path=path)
    textures = next((pair for pair in _TEXTURES if set(pair) <= vertex.keys()), None)
    uv = corner_uv = None
    if textures is not None:
        uv = np.stack([vertex[axis][0] for axis in textures], axis=1).astype(np.float32)
    elif "texcoord" in face and np.array_equal(face["texcoord"][1], 2 * counts):
        corner_uv = face["texcoord"][0].reshape(-1, 2).astype(np.float32)
    return PlyFile(vertices, counts, corners, uv, corner_uv)
