"""Validation of a glTF file's JSON before use: types, integers, sizes, and paths of buffers."""

from __future__ import annotations

from pathlib import PurePosixPath, PureWindowsPath
from typing import Any
from urllib.parse import unquote, urlsplit

from warpjld.errors import InputError
from warpjld.limits import check_limit

__all__ = ["check_schema", "inside_folder"]

_LISTS = ("accessors", "animations", "bufferViews", "buffers", "materials", "meshes", "nodes", "scenes", "skins")
_WHOLE = {
    "accessors": ("bufferView", "byteOffset", "componentType", "count"),
    "bufferViews": ("buffer", "byteOffset", "byteLength", "byteStride"),
    "buffers": ("byteLength",),
    "nodes": ("mesh", "skin", "camera"),
    "skins": ("inverseBindMatrices", "skeleton"),
}
"""Indices and counts: integers that are not negative."""
_MOST = 2**53  # smallest integer that a JSON number does not represent exactly


def check_schema(content: dict[str, Any]) -> None:
    """Check that lists are lists of objects, and that indices and counts are non-negative integers.

    Raises:
        InputError: They are not, or there are more nodes than the limit allows; without the path.
    """
    for name in _LISTS:
        rows = content.get(name)
        if rows is None:
            continue
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise InputError(f"is not a glTF 2.0 file: '{name}' is no list of objects")
        for number, row in enumerate(rows):
            if not isinstance(row.get("name", ""), str | None):
                raise InputError(f"is not a glTF 2.0 file: {name}[{number}].name is no text")
            for key in _WHOLE.get(name, ()):
                _check_whole(row.get(key), f"{name}[{number}].{key}")
    check_limit("nodes", len(content.get("nodes") or ()))
    for number, skin in enumerate(content.get("skins") or ()):
        if not isinstance(skin.get("joints"), list):
            raise InputError(f"is not a glTF 2.0 file: skins[{number}].joints is no list")
        check_limit("joints", len(skin["joints"]), of=f"skins[{number}]")
    for number, accessor in enumerate(content.get("accessors") or ()):
        sparse = accessor.get("sparse")
        if sparse is None:
            continue
        what = f"accessors[{number}].sparse"
        parts = [sparse.get(part) if isinstance(sparse, dict) else None for part in ("indices", "values")]
        if not all(isinstance(part, dict) for part in parts):
            raise InputError(f"is not a glTF 2.0 file: {what} wants count, indices and values")
        _check_whole(sparse.get("count"), f"{what}.count")
        for part in parts:
            for key in ("bufferView", "byteOffset", "componentType"):
                _check_whole(part.get(key), f"{what}: {key}")  # type: ignore[union-attr]
    for number, node in enumerate(content.get("nodes") or ()):
        for child in node.get("children") or ():
            _check_whole(child, f"nodes[{number}].children")


def inside_folder(uri: str) -> str:
    """The relative path of a buffer's URI, inside the folder of its file.

    Raises:
        InputError: It is outside: an input file must not give access to other files of the machine.
    """
    path = unquote(uri)
    parts = (*PurePosixPath(path).parts, *PureWindowsPath(path).parts)
    elsewhere = PurePosixPath(path).is_absolute() or PureWindowsPath(path).anchor or ".." in parts
    if elsewhere or "\0" in path or urlsplit(uri).scheme:
        raise InputError("it leads out of the file's own folder")
    return path


def _check_whole(value: Any, what: str) -> None:
    if value is None:
        return
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (number and 0 <= value < _MOST and value == int(value)):
        raise InputError(f"is not a glTF 2.0 file: {what} wants a whole number from 0 on, got {value!r:.40}")
