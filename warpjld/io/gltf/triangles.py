"""Positions and triangles of a glTF primitive, validated; lists, strips and fans."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.gltf.document import Document
from warpjld.io.gltf.morph import morphed
from warpjld.limits import check_limit

__all__ = ["is_surface", "primitive_points", "primitive_triangles"]

_TRIANGLES, _STRIP, _FAN = 4, 5, 6  # primitive modes of glTF


def is_surface(primitive: Any) -> bool:
    """Whether a primitive consists of triangles, not points or lines."""
    return primitive.mode is None or primitive.mode in (_TRIANGLES, _STRIP, _FAN)


def primitive_points(document: Document, primitive: Any, node: int, name: str) -> NDArray[np.float64]:
    """Positions with morph targets at their default weights, shape (V, 3).

    Raises:
        InputError: No positions, wrong type, or not finite.
    """
    position = vars(primitive.attributes).get("POSITION")
    if position is None:
        raise InputError(f"mesh '{name}' has no positions", path=document.path)
    points = document.accessor(position).astype(np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"mesh '{name}': positions are no VEC3", path=document.path)
    points = morphed(document, primitive, node, points, name)
    if not np.isfinite(points).all():
        bad = int(np.argwhere(~np.isfinite(points))[0][0])
        raise InputError(f"mesh '{name}': vertex {bad} is not finite", path=document.path)
    return points


def primitive_triangles(document: Document, primitive: Any, count: int, name: str) -> NDArray[np.int64]:
    """Triangles over ``count`` vertices, oriented as in the file, shape (T, 3).

    Raises:
        InputError: Indices that are no unsigned integers, out of range, or not a multiple of three.
    """
    if primitive.indices is None:
        corners = np.arange(count)
    else:
        indices = document.accessor(primitive.indices)
        if indices.dtype.kind != "u" or indices.ndim != 1:
            raise InputError(f"mesh '{name}': its face indices are no unsigned integers", path=document.path)
        corners = indices.astype(np.int64)
    if corners.size and corners.max() >= count:
        raise InputError(
            f"mesh '{name}': face index {corners.max()} is beyond its {count} vertices", path=document.path
        )
    mode = _TRIANGLES if primitive.mode is None else primitive.mode
    check_limit("faces", len(corners) // 3 if mode == _TRIANGLES else len(corners), path=document.path)
    if mode == _TRIANGLES:
        if len(corners) % 3:
            raise InputError(f"mesh '{name}': {len(corners)} indices are not whole triangles", path=document.path)
        return corners.reshape(-1, 3)
    steps = np.arange(max(len(corners) - 2, 0))
    if mode == _FAN:
        return np.stack([corners[np.zeros_like(steps)], corners[steps + 1], corners[steps + 2]], axis=1)
    odd = steps % 2
    return np.stack([corners[steps], corners[steps + 1 + odd], corners[steps + 2 - odd]], axis=1)
