"""Reader of Wavefront OBJ that keeps every ``v`` line as a vertex, in the file's order.

Own parser, since libraries change the vertex order, which exports must keep, or fail silently: trimesh and VTK split
vertices at texture or material seams, tinyobjloader 2.0 loses the first vertex of a file with a byte order mark and
rejects comments after a face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.text_file import read_text
from warpjld.geometry.surface import Part
from warpjld.io.polygons import triangulate_polygons

__all__ = ["ObjFile", "read_obj"]


_GO_ON = ("v", "vt", "f", "fo")
"""Keywords of lines that a backslash continues; in comments and names it may belong to a Windows path."""

_MOST = 2**31  # limit of indices


@dataclass(frozen=True, eq=False)
class ObjFile:
    """The triangles of an OBJ file.

    Attributes:
        vertices: Position of every ``v`` line, including unused ones, shape (W, 3).
        faces: Triangles, shape (S, 3); larger polygons, also concave ones, are split.
        corner_uv: Texture coordinates of the triangles' corners, shape (S, 3, 2), or None.
        parts: The file's objects (``o``) if each has a contiguous range of vertices, else the file as a whole.
        notes: Repairs, for the user.
        polygons: Face of the file that each triangle is part of, counted from 0, shape (S,).
        libraries: Names of its material libraries.
        materials: Names of materials (empty: none) and the triangles that have them, in order.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    corner_uv: NDArray[np.float32] | None
    parts: tuple[Part, ...]
    notes: tuple[str, ...]
    polygons: NDArray[np.int64]
    libraries: tuple[str, ...] = ()
    materials: tuple[tuple[str, slice], ...] = ()


@dataclass
class _Lines:
    """Tokens of the file's lines; line numbers of vertices, texture coordinates and faces count from one."""

    vertices: list[list[str]] = field(default_factory=list)
    vertex_lines: list[int] = field(default_factory=list)
    textures: list[list[str]] = field(default_factory=list)
    texture_lines: list[int] = field(default_factory=list)
    corners: list[int] = field(default_factory=list)
    texture_corners: list[int] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    face_lines: list[int] = field(default_factory=list)
    objects: list[tuple[str, int]] = field(default_factory=list)
    libraries: list[str] = field(default_factory=list)
    materials: list[tuple[str, int]] = field(default_factory=list)


def read_obj(path: str | Path) -> ObjFile:
    """Read the polygons of an OBJ file; lines, curves and normals are ignored.

    Numbers may be separated by blanks or tabs, a backslash continues lines, comments may follow anything, and the file
    may start with a byte order mark. Indices count from one, negative ones backwards from the last vertex so far.

    Raises:
        InputError: It cannot be read, a line is invalid, or there are no faces.
    """
    path = Path(path)
    lines = _split(read_text(path, errors="replace"), path)  # names may be in any encoding
    vertices = _numbers(lines.vertices, lines.vertex_lines, 3, path)
    corners, counts = np.array(lines.corners, dtype=np.int64), np.array(lines.counts, dtype=np.int64)
    _check(corners, len(vertices), "vertex", lines, path)
    triangles, polygon = triangulate_polygons(vertices[corners], counts)
    if not len(triangles):
        raise InputError("has no triangles", path=path)
    notes = []
    if (counts < 3).any():
        notes.append(f"{int((counts < 3).sum())} faces with fewer than three corners left out")
    corner_uv = _corner_uv(lines, triangles, path, notes)
    faces = corners[triangles]
    parts = _parts(lines.objects, len(vertices), faces, polygon)
    if len(parts) < 2:
        name = parts[0].name if parts else ""
        parts = (Part(name or path.stem, slice(0, len(vertices)), slice(0, len(faces))),)
    materials = _runs(lines.materials, len(faces), polygon)
    return ObjFile(vertices, faces, corner_uv, parts, tuple(notes), polygon, tuple(lines.libraries), materials)


def _split(text: str, path: Path) -> _Lines:
    out = _Lines()
    continued, begun = "", 0
    for number, line in enumerate(text.split("\n"), 1):
        begun = begun or number
        line = continued + line
        if line.rstrip().endswith("\\") and line.split(None, 1)[0] in _GO_ON:
            continued = line.rstrip()[:-1] + " "
            continue
        first, continued, begun = begun, "", 0
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        match words[0]:
            case "v":
                out.vertices.append(words[1:4])
                out.vertex_lines.append(first)
            case "vt":
                out.textures.append([*words[1:3], "0"][:2])  # a texture for curves may have u only
                out.texture_lines.append(first)
            case "f" | "fo":
                _add_face(out, words[1:], first, path)
            case "o":
                out.objects.append((_rest(line), len(out.counts)))
            case "mtllib":
                out.libraries.append(_rest(line))
            case "usemtl":
                out.materials.append((_rest(line), len(out.counts)))
    return out


def _rest(line: str) -> str:
    """What follows a line's keyword."""
    return "".join(line.split(None, 1)[1:]).strip()


def _runs(begins: list[tuple[str, int]], count: int, polygon: NDArray[np.int64]) -> tuple[tuple[str, slice], ...]:
    """Names and the ranges of the ``count`` triangles that they hold for; ``begins``: names and their first faces."""
    names = ["", *(name for name, _ in begins)]
    bounds = [0, *(int(np.searchsorted(polygon, start)) for _, start in begins), count]
    return tuple((name, slice(a, b)) for name, a, b in zip(names, bounds, bounds[1:], strict=False) if b > a)


def _add_face(out: _Lines, words: list[str], line: int, path: Path) -> None:
    for corner in words:
        word = corner[:40]  # limits the length of messages
        vertex, _, rest = word.partition("/")
        texture = rest.partition("/")[0]
        try:
            v, t = int(vertex), int(texture) if texture else None
        except ValueError:
            raise InputError(f"want corners as 1, 1/1, 1//1 or 1/1/1, got '{word}'", path=path, line=line) from None
        if max(v, t or 0) > _MOST:
            raise InputError(f"'{word}': there is no such vertex", path=path, line=line)
        out.corners.append(_counted(v, len(out.vertices)))
        out.texture_corners.append(-1 if t is None else _counted(t, len(out.textures)))
        if out.corners[-1] < 0 or (t is not None and out.texture_corners[-1] < 0):
            raise InputError(f"'{word}': indices count from 1, or from -1 backwards", path=path, line=line)
    out.counts.append(len(words))
    out.face_lines.append(line)


def _counted(index: int, count: int) -> int:
    """A zero-based index: the file's count from one, or backwards from the last of ``count`` so far."""
    return index - 1 if index > 0 else count + index if index < 0 else -1


def _numbers(rows: list[list[str]], lines: Sequence[int], width: int, path: Path) -> NDArray[np.float64]:
    try:
        out = np.array([[float(word) for word in row] for row in rows], dtype=np.float64).reshape(-1, width)
    except ValueError:
        for row, line in zip(rows, lines, strict=True):
            try:
                good = len([float(word) for word in row]) == width
            except ValueError:
                good = False
            if not good:
                raise InputError(f"want {width} numbers, got '{' '.join(row)}'", path=path, line=line) from None
        raise
    bad = np.flatnonzero(~np.isfinite(out).all(axis=1))
    if len(bad):
        raise InputError(f"want finite numbers, got '{' '.join(rows[bad[0]])}'", path=path, line=lines[bad[0]])
    return out


def _check(corners: NDArray[np.int64], count: int, what: str, lines: _Lines, path: Path) -> None:
    bad = np.flatnonzero(corners >= count)
    if len(bad):
        face = int(np.searchsorted(np.cumsum(lines.counts), bad[0], side="right"))
        said = f"there is no {what} {corners[bad[0]] + 1}: the file has {count}"
        raise InputError(said, path=path, line=lines.face_lines[face])


def _corner_uv(lines: _Lines, triangles: NDArray[np.int64], path: Path, notes: list[str]) -> NDArray[np.float32] | None:
    corners = np.array(lines.texture_corners, dtype=np.int64)[triangles]
    if (corners < 0).all():
        return None
    uv = _numbers(lines.textures, lines.texture_lines, 2, path)
    _check(np.array(lines.texture_corners, dtype=np.int64), len(uv), "vt", lines, path)
    missing = int((corners < 0).sum())
    if missing:
        notes.append(f"{missing} corners have no texture coordinates: 0, 0")
    return np.vstack([uv, np.zeros((1, 2))]).astype(np.float32)[corners]  # -1: the last row


def _parts(
    objects: list[tuple[str, int]], count: int, faces: NDArray[np.int64], polygon: NDArray[np.int64]
) -> tuple[Part, ...]:
    """One part per object; none if objects share vertices, or use them in another order."""
    found = _runs(objects, len(faces), polygon)
    runs = [run for _, run in found]
    lows = [int(faces[run].min()) for run in runs]
    highs = [int(faces[run].max()) for run in runs]
    if any(high >= low for high, low in zip(highs, lows[1:], strict=False)):
        return ()
    ends = [0, *lows[1:], count]  # unused vertices belong to the object before them
    return tuple(Part(name, slice(ends[k], ends[k + 1]), run) for k, (name, run) in enumerate(found))
