"""Reader of text OFF (Geomview): vertices in the file's order, polygons of any number of corners.

Own parser: trimesh triangulates concave polygons wrongly and fails on those of more than four corners.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.text_file import read_text

__all__ = ["read_off"]

_HEAD = re.compile(r"(ST)?C?N?OFF\b")  # texture coordinates, colours and normals follow the position


def read_off(path: str | Path) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Vertices (W, 3), number of corners of every polygon (P,), and vertex indices of all corners (C,).

    Raises:
        InputError: It cannot be read, or is not valid OFF.
    """
    path = Path(path)
    stripped = (line.split("#", 1)[0].strip() for line in read_text(path, errors="replace").split("\n"))
    lines = [(number, line) for number, line in enumerate(stripped, 1) if line]
    head = _HEAD.match(lines[0][1]) if lines else None
    if head is None or "BINARY" in lines[0][1]:
        raise InputError("is no OFF file in text: want OFF in its first line", path=path)
    rest = lines[0][1][head.end() :].strip()
    lines[:1] = [(lines[0][0], rest)] if rest else []
    sizes = [int(word) for word in lines[0][1].split()[:2] if word.isdecimal() and len(word) < 12] if lines else []
    if len(sizes) != 2:
        raise InputError("want the numbers of vertices and faces after OFF", path=path)
    points, faces = lines[1 : 1 + sizes[0]], lines[1 + sizes[0] : 1 + sum(sizes)]
    if len(points) + len(faces) < sum(sizes):
        said = f"announces {sizes[0]} vertices and {sizes[1]} faces, but has {len(lines) - 1} lines of them"
        raise InputError(said, path=path)
    vertices = [_numbers(line, 3, number, path) for number, line in points]
    polygons = [_polygon(line, sizes[0], number, path) for number, line in faces]
    return (
        np.array(vertices, dtype=np.float64).reshape(-1, 3),
        np.array([len(polygon) for polygon in polygons], dtype=np.int64),
        np.array([corner for polygon in polygons for corner in polygon], dtype=np.int64),
    )


def _numbers(line: str, count: int, number: int, path: Path) -> list[float]:
    try:
        found = [float(word) for word in line.split()[:count]]
    except ValueError:
        found = []
    if len(found) < count:
        raise InputError(f"want {count} numbers, got '{line[:60]}'", path=path, line=number)
    return found


def _polygon(line: str, count: int, number: int, path: Path) -> list[int]:
    words = line.split()
    try:
        size = int(words[0])
        found = [int(word) for word in words[1 : 1 + size]]
    except ValueError:
        size, found = -1, []
    if len(found) != size or not all(0 <= corner < count for corner in found):
        want = f"a number of corners, then as many of the vertices 0…{count - 1}"
        raise InputError(f"want {want}, got '{line[:60]}'", path=path, line=number)
    return found
