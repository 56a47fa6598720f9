"""An opened and validated glTF 2.0 file (.gltf or .glb): buffers, accessors and node tree."""

from __future__ import annotations

import base64
import binascii
from contextlib import AbstractContextManager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.files.reading import reading
from warpjld.geometry.rotations import matrices
from warpjld.geometry.scales import never_zero, regular_linear
from warpjld.io.gltf.accessor import read_accessor
from warpjld.io.gltf.container import read_container
from warpjld.io.gltf.extensions import check_extensions, packed_view
from warpjld.io.gltf.objects import gltf_objects
from warpjld.io.gltf.schema import check_schema, inside_folder
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["Document", "open_document"]

_FURTHEST = 1e12  # largest plausible coordinate in the file's units
_KIND = "a glTF 2.0 file"
_UNPACK = "export it without compression"


class Document:
    """An open file: ``gltf`` is pygltflib's tree of objects, ``content`` the complete JSON (pygltflib drops some of
    it); arrays and transforms are returned by the methods."""

    def __init__(self, path: Path, gltf: Any, content: dict[str, Any]) -> None:
        self.path = path
        self.gltf = gltf
        self.content = content

    @cached_property
    def buffers(self) -> list[bytes | memoryview]:
        """Raw bytes of every buffer: the GLB's own chunk, data URIs, or files beside the document."""
        return [self._buffer(i, buffer) for i, buffer in enumerate(self.gltf.buffers)]

    def view_bytes(self, index: int | None) -> bytes:
        """The bytes of a buffer view.

        Raises:
            InputError: The view does not exist, or exceeds its buffer.
        """
        views = self.gltf.bufferViews
        if index is None or not 0 <= index < len(views) or not 0 <= views[index].buffer < len(self.gltf.buffers):
            raise InputError(f"buffer view {index} does not exist", path=self.path)
        data, start = self.buffers[views[index].buffer], views[index].byteOffset or 0
        if start < 0 or not 0 <= views[index].byteLength <= len(data) - start:
            raise InputError(f"buffer view {index} ends beyond its buffer", path=self.path)
        return bytes(data[start : start + views[index].byteLength])

    def accessor(self, index: int) -> NDArray[Any]:
        """An accessor's elements, shape (n,), (n, k) or (n, rows, columns); normalised integers as float64.

        Raises:
            InputError: It does not exist, exceeds the file, or is of an unknown type.
        """
        if (extension := packed_view(self.gltf, index)) is not None:
            raise InputError(f"accessor {index} is compressed with {extension}: {_UNPACK}", path=self.path)
        try:
            return read_accessor(self.gltf, self.buffers, index)
        except InputError as error:
            raise InputError(error.message, path=self.path) from None

    def reading(self) -> AbstractContextManager[None]:
        """Context in which type errors are reported as an invalid file: pygltflib accepts any JSON, so that wrong types
        (a text instead of a number) appear only when used."""
        return reading(self.path, _KIND)

    def name(self, node: int) -> str:
        """A node's name, or ``node 7`` if it has none."""
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
        # nodes that are not reached from a root form a cycle
        reached = np.zeros(count, dtype=bool)
        todo = np.flatnonzero(parents < 0).tolist()
        while todo:
            node = todo.pop()
            reached[node] = True
            todo.extend(self.gltf.nodes[node].children or ())
        if not reached.all():
            raise InputError(f"node '{self.name(int(np.argmin(reached)))}' is its own ancestor", path=self.path)
        return parents

    @cached_property
    def worlds(self) -> NDArray[np.float64]:
        """Node-to-world transforms of the displayed pose, shape (N, 4, 4).

        Raises:
            InputError: A transform that is not finite, or implausibly large.
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

    @cached_property
    def shown(self) -> frozenset[int]:
        """Nodes of the default scene; all nodes if the file has no scene."""
        scenes = self.gltf.scenes
        if not scenes:
            return frozenset(range(len(self.gltf.nodes)))
        number = self.gltf.scene or 0
        if not 0 <= number < len(scenes):
            raise InputError(f"its default scene {number} does not exist", path=self.path)
        out: set[int] = set()
        todo = list(scenes[number].nodes or ())
        while todo:
            node = todo.pop()
            if not 0 <= node < len(self.gltf.nodes):
                raise InputError(f"scene {number}: node {node} does not exist", path=self.path)
            if node not in out:
                out.add(node)
                todo.extend(self.gltf.nodes[node].children or ())
        return frozenset(out)

    @cached_property
    def flattened(self) -> tuple[int, ...]:
        """Nodes with zero scale in some direction; their transforms have a tiny one instead, so that they are
        invertible."""
        return tuple(n for n in range(len(self.gltf.nodes)) if not _invertible(self._plain(n)[:3, :3]))

    def local(self, node: int) -> NDArray[np.float64]:
        """A node's transform relative to its parent, shape (4, 4); zero scale is replaced by a tiny one.

        Raises:
            InputError: A rotation of length zero.
        """
        record = self.gltf.nodes[node]
        out = self._plain(node)
        if record.matrix is not None and np.isfinite(out).all() and not _invertible(out[:3, :3]):
            out[:3, :3] = regular_linear(out[:3, :3])
        elif record.matrix is None:
            _, rotation, scale = self.parts(node)
            out[:3, :3] = matrices(rotation) * never_zero(scale)
        return out

    def parts(self, node: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """A node's translation, rotation (unit quaternion x, y, z, w) and scale; a matrix must be free of shear.

        Raises:
            InputError: A rotation of length zero, or a matrix with shear.
        """
        record = self.gltf.nodes[node]
        if record.matrix is not None:
            matrix = self._plain(node)
            scale = np.linalg.norm(matrix[:3, :3], axis=0)
            turned = matrix[:3, :3] / np.where(scale > 0.0, scale, 1.0)
            if np.linalg.det(turned) < 0.0:
                turned[:, 0], scale[0] = -turned[:, 0], -scale[0]
            if not np.allclose(turned.T @ turned, np.eye(3), atol=1e-3):
                raise InputError(
                    f"node '{self.name(node)}' is animated, yet has a matrix with shear or zero scale", path=self.path
                )
            return matrix[:3, 3], transform.Rotation.from_matrix(turned).as_quat(), scale
        quaternion = np.array(record.rotation or (0.0, 0.0, 0.0, 1.0), dtype=np.float64)
        length = np.linalg.norm(quaternion)
        if not length > 0.0:
            raise InputError(f"node '{self.name(node)}': its rotation is not a quaternion", path=self.path)
        translation = np.array(record.translation or (0.0, 0.0, 0.0), dtype=np.float64)
        return translation, quaternion / length, np.array(record.scale or (1.0, 1.0, 1.0), dtype=np.float64)

    def _plain(self, node: int) -> NDArray[np.float64]:
        """A node's transform relative to its parent as the file states it, shape (4, 4)."""
        record = self.gltf.nodes[node]
        if record.matrix is not None:
            return np.array(record.matrix, dtype=np.float64).reshape(4, 4).T  # glTF stores columns
        local = np.eye(4)
        local[:3, 3], rotation, scale = self.parts(node)
        local[:3, :3] = matrices(rotation) * scale
        return local

    def _buffer(self, index: int, buffer: Any) -> bytes | memoryview:
        uri = buffer.uri
        if uri is None:
            data: bytes | memoryview = self.gltf.binary_blob() or b""
        elif uri.startswith("data:"):
            data = _data_uri(uri, f"buffer {index}", self.path)
        else:
            try:
                data = read_bytes(self.path.parent / inside_folder(uri))
            except InputError as error:
                raise InputError(
                    f"buffer {index} is in '{unquote(uri)}', which cannot be read: {error.message}", path=self.path
                ) from None
        if len(data) < buffer.byteLength:
            raise InputError(
                f"buffer {index} is truncated: {buffer.byteLength} bytes expected, {len(data)} there", path=self.path
            )
        return data


def open_document(path: str | Path) -> Document:
    """Open a .gltf or .glb file.

    Raises:
        InputError: No such file, not glTF 2.0, truncated, or an unsupported required extension.
    """
    path = Path(path)
    _, content, blob = read_container(path)
    with reading(path, _KIND):
        check_schema(content)
        gltf = gltf_objects(content)
        check_extensions(gltf)
    if blob is not None:
        gltf.set_binary_blob(blob)
    return Document(path, gltf, content)


def _invertible(linear: NDArray[np.float64]) -> bool:
    lengths = np.linalg.svd(linear, compute_uv=False) if np.isfinite(linear).all() else np.ones(3)
    return bool(lengths[-1] > 1e-7 * max(lengths[0], 1.0))


def _data_uri(uri: str, what: str, path: Path) -> bytes:
    """Bytes of a data URI of any media type (RFC 2397)."""
    head, comma, content = uri.partition(",")
    if not comma:
        raise InputError(f"{what}: its data URI has no data", path=path)
    if not head.endswith(";base64"):
        return unquote_to_bytes(content)
    try:
        return base64.b64decode("".join(unquote(content).split()), validate=True)
    except binascii.Error as error:
        raise InputError(f"{what}: its data URI is not base64: {error}", path=path) from None
