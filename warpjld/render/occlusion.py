"""Screen-space ambient occlusion from a picture's depths, which darkens creases and contacts.

VTK's own pass is not used, since with software rendering its pictures differ from run to run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["occlusion", "shade"]

_SAMPLES = 20  # samples per pixel
_TILE = 4  # side of the squares within which sample directions are rotated, and radius of the blur
_BIAS = 0.12  # cosine to the normal below which a sample does not occlude
_STRENGTH = 4.2  # factor of the occlusion, chosen by eye


def shade(picture: NDArray[np.uint8], shadow: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Darken a picture (h, w, 3) by an occlusion (h, w), the red channel least, to imitate light scattered in skin."""
    kept = 1 - shadow[..., None] * np.array([0.62, 0.78, 0.84])
    return np.rint(picture * kept).astype(np.uint8)


def occlusion(depth: NDArray[np.floating], focal: float, radius: float) -> NDArray[np.float32]:
    """Occluded share of the ambient light at each pixel.

    Each visible point samples others within ``radius``: those above its tangent plane occlude light, the more the
    nearer they are.

    Args:
        depth: Distance of each pixel along the camera's axis [m], shape (h, w); not finite in the background.
        focal: Distance of the picture plane [pixels].
        radius: Largest distance of occluding points [m].

    Returns:
        0…1, shape (h, w).
    """
    result = np.zeros(depth.shape, np.float32)
    solid = np.isfinite(depth)
    if not solid.any():
        return result
    rows, columns = np.flatnonzero(solid.any(axis=1)), np.flatnonzero(solid.any(axis=0))
    window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    solid = solid[window]
    z = np.where(solid, depth[window], np.nan).astype(np.float32)
    height, width = z.shape
    # pixel coordinates relative to the centre of the whole picture; y down, z away from the eye
    ys, xs = np.indices(z.shape, dtype=np.float32)
    xs += columns[0] - depth.shape[1] / 2
    ys += rows[0] - depth.shape[0] / 2
    points = np.stack([xs * z / focal, ys * z / focal, z], axis=-1)
    normals = _normals(points)

    y, x = np.nonzero(solid & np.isfinite(normals).all(axis=-1))
    here, normal = points[y, x], normals[y, x]
    reach = np.clip(radius * focal / here[:, 2], 2, 0.25 * max(depth.shape))
    turn = 2 * np.pi * ((x % _TILE) * _TILE + (y % _TILE)).astype(np.float32) / _TILE**2
    hidden = np.zeros(len(here), np.float32)
    for k in range(_SAMPLES):
        share = (k + 0.5) / _SAMPLES
        direction = turn + np.float32(2.399963 * k)  # the golden angle spreads the samples evenly
        u = np.rint(x + reach * share * np.cos(direction)).astype(np.int32)
        v = np.rint(y + reach * share * np.sin(direction)).astype(np.int32)
        inside = (u >= 0) & (u < width) & (v >= 0) & (v < height)
        towards = points[np.where(inside, v, 0), np.where(inside, u, 0)] - here
        square = np.einsum("ij,ij->i", towards, towards)
        rise = np.einsum("ij,ij->i", towards, normal) / np.sqrt(square + 1e-20)
        near = np.maximum(1 - square / np.float32(radius) ** 2, 0)
        seen = np.maximum(rise - _BIAS, 0) * near
        hidden += np.where(inside & np.isfinite(seen), seen, 0)
    raw = np.zeros(z.shape, np.float32)
    raw[y, x] = np.clip(_STRENGTH * hidden / _SAMPLES, 0, 1)
    result[window] = np.where(solid, _smooth(raw, z, 0.25 * radius), 0)
    return result


def _normals(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Unit normals towards the eye, shape (h, w, 3), by differences to the neighbour on each axis that is nearer in
    depth, since the other may lie beyond a silhouette."""
    sides = []
    for axis in (1, 0):
        step = np.diff(points, axis=axis)
        pad = [(0, 0)] * 3
        pad[axis] = (0, 1)
        ahead = np.pad(step, pad, constant_values=np.nan)
        pad[axis] = (1, 0)
        behind = np.pad(step, pad, constant_values=np.nan)
        jump, back = (np.nan_to_num(np.abs(side[..., 2:]), nan=np.inf) for side in (ahead, behind))
        sides.append(np.where(jump <= back, ahead, behind))
    normals = np.cross(sides[1], sides[0])  # x right, y down, z away: their order turns the normal to the eye
    return normals / (np.linalg.norm(normals, axis=-1, keepdims=True) + 1e-30)


def _smooth(values: NDArray[np.float32], depth: NDArray[np.float32], step: float) -> NDArray[np.float32]:
    """Separable bilateral blur: mean over neighbours whose depth differs by less than ``step``, shape (h, w)."""
    for axis in (0, 1):
        total, weight = np.zeros_like(values), np.zeros_like(values)
        for shift in range(-_TILE, _TILE + 1):
            there = np.roll(depth, shift, axis=axis)
            same = (np.abs(there - depth) < step).astype(np.float32) * (1 - abs(shift) / (_TILE + 1))
            total += same * np.roll(values, shift, axis=axis)
            weight += same
        values = (total / np.maximum(weight, 1e-6)).astype(np.float32)
    return values
