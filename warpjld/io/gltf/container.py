"""Reader of a .gltf or .glb file's JSON and binary chunk."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.files.text_file import parse_json

__all__ = ["read_container"]

_BOM = b"\xef\xbb\xbf"
_JSON, _BINARY = 0x4E4F534A, 0x004E4942  # chunk types of GLB: "JSON", "BIN\0"


def read_container(path: Path) -> tuple[str, dict[str, Any], memoryview | None]:
    """JSON of a glTF 2.0 file, as text and parsed, and its binary chunk (a view, not a copy), None without one.

    Raises:
        InputError: It cannot be read, is truncated, is glTF 1.0, or not glTF.
    """
    data = read_bytes(path)
    if data[:4] == b"glTF":
        raw, blob = _chunks(path, data)
    elif data.removeprefix(_BOM).lstrip()[:1] == b"{":
        raw, blob = data, None
    else:
        raise InputError("is not a glTF 2.0 file: neither binary nor JSON", path=path)
    try:
        text = raw.decode("utf-8-sig")
        content = parse_json(text, path)
    except UnicodeDecodeError as error:
        raise InputError(f"is not a glTF 2.0 file: no UTF-8 text (byte {error.start})", path=path) from None
    except InputError as error:
        raise InputError(f"is not a glTF 2.0 file: {error.message}", path=path) from None
    content = content if isinstance(content, dict) else {}
    asset = content.get("asset")
    version = str(asset.get("version", "")) if isinstance(asset, dict) else ""
    if version.startswith("1.") or (not version and isinstance(content.get("meshes"), dict)):
        raise InputError("is glTF 1.0: only version 2.0 is read", path=path)
    if not version.startswith("2."):
        raise InputError("is not a glTF 2.0 file: no asset version 2", path=path)
    return text, content, blob


def _chunks(path: Path, data: bytes) -> tuple[bytes, memoryview | None]:
    if len(data) < 20:
        raise InputError(f"is truncated: a GLB starts with a 20 byte header, got {len(data)} bytes", path=path)
    version, length = struct.unpack_from("<II", data, 4)
    if version == 1:
        raise InputError("is glTF 1.0: only version 2.0 is read", path=path)
    if version != 2:
        raise InputError(f"is GLB version {version}: version 2 is read", path=path)
    if len(data) < length:
        raise InputError(f"is truncated: its header says {length} bytes, got {len(data)}", path=path)
    found: dict[int, memoryview] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > len(data):
            raise InputError(f"is truncated: a chunk of {size} bytes is not there whole", path=path)
        found.setdefault(kind, memoryview(data)[at + 8 : at + 8 + size])
        at += 8 + size + (-size % 4)
    if _JSON not in found:
        raise InputError("is not a glTF 2.0 file: no JSON chunk", path=path)
    return bytes(found[_JSON]), found.get(_BINARY)
