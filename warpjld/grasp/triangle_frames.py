"""Triangles in their own planes: where a point lies over one, in few multiplications."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["triangle_frames"]


def triangle_frames(corners: NDArray[np.floating]) -> NDArray[np.float32]:
    """Frames of triangles (…, 3, 3), shape (…, 20).

    The longest edge begins at the origin A and goes along x to B, the third corner C lies at y ≥ 0. A frame holds the
    axes x, y, z (9 numbers), their offsets (3: coordinate = axis · point + offset), the length of AB, the unit vector
    and length of BC, those of AC (in the plane, 3 each), and the error of a distance, without the point's share [m]. A
    triangle without area lies along x, in any plane.
    """
    from warpjld_kernels.triangle_tree import FRAME, FRAME_ROUNDING

    at = np.asarray(corners, dtype=np.float64)
    edges = np.roll(at, -1, axis=-2) - at
    longest = (edges**2).sum(axis=-1).argmax(axis=-1)
    turned = (longest[..., None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(at, turned[..., None], axis=-2), -2, 0)
    x = _unit(b - a, _across(c - a))
    y = c - a - ((c - a) * x).sum(axis=-1, keepdims=True) * x
    y = _unit(y - (y * x).sum(axis=-1, keepdims=True) * x, _across(x))
    axes = np.stack([x, y, np.cross(x, y)], axis=-2).astype(np.float32)
    exact = axes.astype(np.float64)
    flat = np.einsum("...ki,...ni->...nk", exact[..., :2, :], np.stack([b - a, c - a], axis=-2))
    over, corner = flat[..., 0, :1] * [1.0, 0.0], flat[..., 1, :]
    out = np.empty((*at.shape[:-2], FRAME))
    out[..., :9] = axes.reshape(*at.shape[:-2], 9)
    out[..., 9:12] = -np.einsum("...ki,...i->...k", exact, a)
    out[..., 12] = over[..., 0]
    for first, way in ((13, corner - over), (16, corner)):
        out[..., first + 2] = np.linalg.norm(way, axis=-1)
        out[..., first : first + 2] = _unit(way, np.broadcast_to([0.0, 1.0], way.shape))
    out[..., 19] = FRAME_ROUNDING * (np.abs(a).sum(axis=-1) + over[..., 0])
    return out.astype(np.float32)


def _unit(vectors: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (…, d); where a vector is zero, the other one."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-30, vectors / np.maximum(length, 1e-30), other)


def _across(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors (…, 3) at right angles to vectors; of a zero vector any."""
    least = np.eye(3)[np.abs(vectors).argmin(axis=-1)]
    across = np.cross(vectors, least)
    return _unit(across, np.broadcast_to([1.0, 0.0, 0.0], vectors.shape))
