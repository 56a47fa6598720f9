"""A GLB file as JSON and one binary chunk, to which arrays can be appended.

The JSON is kept as read, not as objects of pygltflib, which would drop what that library does not know and add its
defaults: a user's file keeps its materials, extensions and extras unchanged.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError

__all__ = ["ARRAY_BUFFER", "ELEMENT_ARRAY_BUFFER", "GlbFile", "read_gltf_json"]

ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963  # targets of buffer views in glTF
_COMPONENTS = {"f4": 5126, "u4": 5125, "u2": 5123}  # component types of glTF
_LARGEST = 2**32 - 1  # lengths are 32 bit


def read_gltf_json(data: bytes) -> dict[str, Any]:
    """The JSON of a .glb or .gltf file that was validated before."""
    if data[:4] == b"glTF":
        (length,) = struct.unpack_from("<I", data, 12)
        data = data[20 : 20 + length]
    content: dict[str, Any] = json.loads(data.decode("utf-8-sig"))
    return content


class GlbFile:
    """JSON and binary content of a GLB file; ``add`` appends an array to both."""

    def __init__(self, content: dict[str, Any], chunks: Sequence[bytes | memoryview]) -> None:
        """Take ownership of ``content``, whose buffers are ``chunks``; these are merged into one buffer."""
        self.content = content
        self._chunks: list[bytes | memoryview] = []
        self._length = 0
        starts = [self.append(chunk) for chunk in chunks]
        for view in content.get("bufferViews", ()):
            view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
            view["buffer"] = 0

    def append(self, data: bytes | memoryview) -> int:
        """Append bytes, which are not copied, at a multiple of four; returns their offset."""
        start = self._length
        for chunk in (data, b"\0" * (-len(data) % 4)):
            self._chunks.append(chunk)
            self._length += len(chunk)
        return start

    def add_view(self, data: bytes | memoryview, target: int | None = None) -> int:
        """Add a buffer view of new bytes; returns its index."""
        view = {"buffer": 0, "byteOffset": self.append(data), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        return self._add("bufferViews", view)

    def add(self, array: NDArray[Any], kind: str, *, target: int | None = None, bounds: bool = False) -> int:
        """Add an accessor of a new float32, uint32 or uint16 array, which is not copied; returns its index.

        Args:
            array: The array, one element per row.
            kind: ``SCALAR``, ``VEC3``, ….
            target: ``ARRAY_BUFFER`` for vertex attributes, ``ELEMENT_ARRAY_BUFFER`` for indices.
            bounds: Whether minimum and maximum are stored, as for positions and times.
        """
        accessor: dict[str, Any] = {
            "bufferView": self.add_view(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data, target),
            "componentType": _COMPONENTS[array.dtype.str.lstrip("<=")],
            "count": len(array),
            "type": kind,
        }
        if bounds:
            rows = array.reshape(len(array), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        return self._add("accessors", accessor)

    def write(self, path: Path) -> None:
        """Write the file.

        Raises:
            InputError: It would exceed the format's largest length.
            OSError: Writing fails.
        """
        self.content["buffers"] = [{"byteLength": self._length}]
        text = json.dumps(self.content, ensure_ascii=False, separators=(",", ":")).encode("utf-8")
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + self._length
        if length > _LARGEST:
            raise InputError(f"would be {length / 2**30:.1f} GB; a .glb file holds up to 4: write fewer frames")
        with path.open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, length))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", self._length, b"BIN\0"))
            file.writelines(self._chunks)

    def _add(self, kind: str, entry: dict[str, Any]) -> int:
        entries = self.content.setdefault(kind, [])
        entries.append(entry)
        return len(entries) - 1
