"""Reader of glTF accessors: typed views into buffers, with strides, sparse values and normalised integers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.limits import check_limit

__all__ = ["read_accessor"]

_COMPONENTS = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_SHAPES: dict[str, tuple[int, ...]] = {
    "SCALAR": (),
    "VEC2": (2,),
    "VEC3": (3,),
    "VEC4": (4,),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}


def read_accessor(gltf: Any, buffers: Sequence[bytes | memoryview], index: int) -> NDArray[Any]:
    """Elements of accessor ``index`` as a new array; matrices as rows and columns.

    Raises:
        InputError: It does not exist, exceeds the file, or is of an unknown type.
    """
    if not 0 <= index < len(gltf.accessors):
        raise InputError(f"accessor {index} does not exist: the file has {len(gltf.accessors)}")
    accessor = gltf.accessors[index]
    what = f"accessor {index}"
    if accessor.componentType not in _COMPONENTS or accessor.type not in _SHAPES:
        raise InputError(f"{what}: unknown type {accessor.type} of {accessor.componentType}")
    dtype: np.dtype[Any] = np.dtype(_COMPONENTS[accessor.componentType]).newbyteorder("<")
    shape = _SHAPES[accessor.type]
    if not accessor.count >= 0:
        raise InputError(f"{what}: {accessor.count} elements; want 0 or more")
    if accessor.bufferView is None:
        check_limit("vertices", accessor.count, of=what)  # others are limited by the file's size
        out = np.zeros((accessor.count, *shape), dtype)
    else:
        out = _strided(gltf, buffers, what, accessor.bufferView, accessor.byteOffset or 0, accessor.count, dtype, shape)
    if accessor.sparse is not None:
        sparse, out = accessor.sparse, out.copy()
        if sparse.indices.componentType not in (5121, 5123, 5125):
            raise InputError(f"{what}: sparse indices of unknown type {sparse.indices.componentType}")
        at_dtype = np.dtype(_COMPONENTS[sparse.indices.componentType]).newbyteorder("<")
        at = _strided(
            gltf, buffers, what, sparse.indices.bufferView, sparse.indices.byteOffset or 0, sparse.count, at_dtype, ()
        )
        if len(at) > accessor.count:
            raise InputError(f"{what}: {len(at)} sparse values for {accessor.count} elements")
        if at.size and at.max() >= accessor.count:
            raise InputError(f"{what}: sparse index {at.max()} is beyond its {accessor.count} elements")
        out[at] = _strided(
            gltf, buffers, what, sparse.values.bufferView, sparse.values.byteOffset or 0, sparse.count, dtype, shape
        )
    if len(shape) == 2:
        out = out.swapaxes(1, 2)  # stored by columns
    if accessor.normalized and dtype.kind != "f":
        return np.maximum(out / (256**dtype.itemsize // (2 if dtype.kind == "i" else 1) - 1), -1.0)
    return out


def _strided(
    gltf: Any,
    buffers: Sequence[bytes | memoryview],
    what: str,
    view_index: int,
    offset: int,
    count: int,
    dtype: np.dtype[Any],
    shape: tuple[int, ...],
) -> NDArray[Any]:
    if not 0 <= view_index < len(gltf.bufferViews):
        raise InputError(f"{what}: buffer view {view_index} does not exist")
    view = gltf.bufferViews[view_index]
    if not 0 <= view.buffer < len(buffers):
        raise InputError(f"{what}: buffer {view.buffer} does not exist")
    size = dtype.itemsize * int(np.prod(shape, dtype=int))
    if len(shape) == 2 and (shape[0] * dtype.itemsize) % 4:
        raise InputError(f"{what}: matrices of components smaller than 4 bytes are not read")
    stride = view.byteStride or size
    if stride < size:
        raise InputError(f"{what}: elements of {size} bytes {stride} bytes apart")
    start = (view.byteOffset or 0) + offset
    if min(stride, offset, view.byteOffset or 0, view.byteLength, count) < 0:
        raise InputError(f"{what}: a count, offset, length or stride below 0")
    end = start + (stride * (count - 1) + size if count else 0)
    limit = min((view.byteOffset or 0) + view.byteLength, len(buffers[view.buffer]))
    if end > limit:
        raise InputError(f"{what}: needs bytes up to {end}, its buffer view ends at {limit}")
    raw = np.frombuffer(buffers[view.buffer], np.uint8, end - start, start)
    rows = np.lib.stride_tricks.as_strided(raw, (count, size), (stride, 1)) if count else raw.reshape(0, size)
    return np.ascontiguousarray(rows).view(dtype).reshape(count, *shape)
