"""A glTF 2.0 file (.gltf or .glb) opened and checked: its buffers, accessors and node tree."""

from __future__ import annotations

import struct
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.io.gltf.accessor import read_accessor

__all__ = ["Document", "open_document"]

_FURTHEST = 1e12


class Document:
    """An open file: ``gltf`` is pygltflib's tree of plain objects; arrays and transforms come from the methods."""

    def __init__(self, path: Path, gltf: Any) -> None:
        self.path = path
        self.gltf = gltf

    @cached_property
    def buffers(self) -> list[bytes]:
        """Raw bytes of every buffer: the GLB's own chunk, data URIs, or files beside the document."""
        return [self._buffer(i, buffer) for i, buffer in enumerate(self.gltf.buffers)]

    def accessor(self, index: int) -> NDArray[Any]:
        """An accessor's elements, shape (n,), (n, k) or (n, rows, columns); normalised integers as float64.

        Raises:
            InputError: It does not exist, points beyond the file, or is of an unknown type.
        """
        try:
            return read_accessor(self.gltf, self.buffers, index)
        except InputError as error:
            raise InputError(error.message, path=self.path) from None

    def name(self, node: int) -> str:
        """A node's name, or ``node 7`` where the file gives none."""
        return self.gltf.nodes[node].name or f"node {node}"

    @cached_property
    def parents(self) -> NDArray[np.int64]:
        """Parent of every node, -1 for roots.

        Raises:
            InputError: Children that do not exist, have two parents, or are their own ancestors.
        """
        count = len(self.gltf.nodes)
        parents = np.full(count, -1)
        for i, node in enumerate(self.gltf.nodes):
            for child in node.children or ():
                if not 0 <= child < count:
                    raise InputError(f"node '{self.name(i)}': child {child} does not exist", path=self.path)
                if parents[child] >= 0:
                    raise InputError(f"node '{self.name(child)}' has two parents", path=self.path)
                parents[child] = i
        for i in range(count):
            above = int(parents[i])
            for _ in range(count):
                if above < 0:
                    break
                above = int(parents[above])
            else:
                raise InputError(f"node '{self.name(i)}' is its own ancestor", path=self.path)
        return parents

    @cached_property
    def worlds(self) -> NDArray[np.float64]:
        """Node-to-world transforms of the pose the file shows, shape (N, 4, 4).

        Raises:
            InputError: A transform that is not finite, or out of all proportion.
        """
        worlds = np.zeros((len(self.gltf.nodes), 4, 4))
        done = np.zeros(len(worlds), dtype=bool)
        for i in range(len(worlds)):
            chain = []
            node = i
            while node >= 0 and not done[node]:
                chain.append(node)
                node = int(self.parents[node])
            for node in reversed(chain):
                above = self.parents[node]
                worlds[node] = (worlds[above] if above >= 0 else np.eye(4)) @ self.local(node)
                done[node] = True
        sane = np.abs(worlds) < _FURTHEST
        if not sane.all():
            bad = int(np.argwhere(~sane)[0][0])
            raise InputError(f"node '{self.name(bad)}': its transform is not finite or too large", path=self.path)
        return worlds

    def local(self, node: int) -> NDArray[np.float64]:
        """A node's transform relative to its parent, shape (4, 4).

        Raises:
            InputError: A rotation without length.
        """
        record = self.gltf.nodes[node]
        if record.matrix is not None:
            return np.array(record.matrix, dtype=np.float64).reshape(4, 4).T  # glTF stores columns
        local = np.eye(4)
        quaternion = np.array(record.rotation or (0.0, 0.0, 0.0, 1.0), dtype=np.float64)
        length = np.linalg.norm(quaternion)
        if not length > 0.0:
            raise InputError(f"node '{self.name(node)}': its rotation is not a quaternion", path=self.path)
        local[:3, :3] = Rotation.from_quat(quaternion / length).as_matrix() * np.array(record.scale or (1.0, 1.0, 1.0))
        local[:3, 3] = record.translation or (0.0, 0.0, 0.0)
        return local

    def _buffer(self, index: int, buffer: Any) -> bytes:
        uri = buffer.uri
        if uri is None:
            data: bytes = self.gltf.binary_blob() or b""
        elif uri.startswith("data:"):
            data = self.gltf.decode_data_uri(uri)
        else:
            file = self.path.parent / unquote(uri)
            try:
                data = file.read_bytes()
            except OSError as error:
                raise InputError(
                    f"buffer {index} is in '{uri}', which cannot be read: {error.strerror}", path=self.path
                ) from None
        if len(data) < buffer.byteLength:
            raise InputError(
                f"buffer {index} is truncated: {buffer.byteLength} bytes expected, {len(data)} there", path=self.path
            )
        return data


def open_document(path: str | Path) -> Document:
    """Open a .gltf or .glb file.

    Raises:
        InputError: No such file, not glTF 2.0, or truncated.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    from pygltflib import GLTF2

    if data[:4] == b"glTF":
        _check_glb(path, data)
    elif data.lstrip()[:1] != b"{":
        raise InputError("is not a glTF 2.0 file: neither binary nor JSON", path=path)
    try:
        gltf = GLTF2().load_from_bytes(data) if data[:4] == b"glTF" else GLTF2.gltf_from_json(data.decode("utf-8"))
    except Exception as error:  # pygltflib raises whatever its JSON layers raise
        raise InputError(f"is not a glTF 2.0 file: {error}", path=path) from None
    if gltf is None or gltf.asset is None or not str(gltf.asset.version).startswith("2."):
        raise InputError("is not a glTF 2.0 file: no asset version 2", path=path)
    needed = set(gltf.extensionsRequired or ()) & {"KHR_draco_mesh_compression", "EXT_meshopt_compression"}
    if needed:
        raise InputError(f"is compressed with {needed.pop()}: export it without compression", path=path)
    return Document(path, gltf)


def _check_glb(path: Path, data: bytes) -> None:
    if len(data) < 20:
        raise InputError(f"is truncated: a GLB starts with a 20 byte header, got {len(data)} bytes", path=path)
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise InputError(f"is GLB version {version}: version 2 is read", path=path)
    if len(data) < length:
        raise InputError(f"is truncated: its header says {length} bytes, got {len(data)}", path=path)
