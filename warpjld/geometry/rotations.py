"""Vectorised quaternion arithmetic: products, minimal rotations, spherical interpolation. Order x, y, z, w."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "about",
    "axis_turns",
    "conjugate",
    "matrices",
    "minimal_rotation",
    "multiply",
    "rotate",
    "slerp",
    "unit",
    "upright",
]

_FEW = 1024  # numbers in an array up to which calls of NumPy take longer than the arithmetic
_FACTORS = np.array([3, 2, 1, 0, 2, 3, 0, 1, 1, 0, 3, 2])  # component of b that x, y and z of a are multiplied by
_SIGNS = np.array([[1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0], [-1.0, 1.0, 1.0, -1.0]])
_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
_PARALLEL = 1e-12  # length of the sum of two unit vectors below which they count as opposite


def unit(vectors: ArrayLike) -> NDArray[np.float64]:
    """Vectors scaled to length one along the last axis; those without length stay zero."""
    array = np.asarray(vectors, dtype=np.float64)
    lengths = np.linalg.norm(array, axis=-1, keepdims=True)
    return np.asarray(array / np.where(lengths > 0.0, lengths, 1.0))


def upright(up: str | None) -> NDArray[np.float64]:
    """Rotation matrix (3, 3) that turns a file's up axis, ``y`` or ``z``, to Y; the identity where it is None."""
    return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]) if up == "z" else np.eye(3)


def about(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions (…, 4) of rotation vectors (…, 3): about their direction by their length [rad]."""
    half = 0.5 * np.linalg.norm(vectors, axis=-1, keepdims=True)
    out = np.empty((*vectors.shape[:-1], 4))
    np.multiply(0.5 * np.sinc(half / np.pi), vectors, out=out[..., :3])
    np.cos(half, out=out[..., 3:])
    return out


def multiply(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hamilton product a b, the rotation by ``b``, then by ``a``; shapes broadcast. Signs are kept, which rotation
    libraries may change."""
    if max(a.size, b.size) < _FEW:  # the same sums in the same order, in a fourth of the calls
        terms = a[..., :3, None] * (b.take(_FACTORS, axis=-1).reshape(*b.shape[:-1], 3, 4) * _SIGNS)
        few = a[..., 3:] * b
        for k in range(3):
            few = few + terms[..., k, :]
        return few
    ax, ay, az, aw = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bx, by, bz, bw = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    x = aw * bx + ax * bw + ay * bz - az * by
    out = np.empty((*x.shape, 4))
    out[..., 0] = x
    out[..., 1] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 2] = aw * bz + ax * by - ay * bx + az * bw
    out[..., 3] = aw * bw - ax * bx - ay * by - az * bz
    return out


def conjugate(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of unit quaternions."""
    return a * np.array([-1.0, -1.0, -1.0, 1.0])


def rotate(a: NDArray[np.float64], vectors: ArrayLike) -> NDArray[np.float64]:
    """Vectors (…, 3) turned by quaternions (…, 4) of any length but zero; shapes broadcast.

    v + 2 u × (u × v + w v) / |q|², u the vector part and w the scalar part of q.
    """
    v = np.asarray(vectors, dtype=np.float64)
    if max(a.size, v.size) < _FEW:  # the same sums in the same order, in half of the calls
        next_u, last_u = a.take(_NEXT, axis=-1), a.take(_LAST, axis=-1)
        t = next_u * v.take(_LAST, axis=-1) - last_u * v.take(_NEXT, axis=-1) + a[..., 3:] * v
        away = next_u * t.take(_LAST, axis=-1) - last_u * t.take(_NEXT, axis=-1)
        return v + 2.0 / (a * a).sum(axis=-1, keepdims=True) * away
    x, y, z, w = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    vx, vy, vz = v[..., 0], v[..., 1], v[..., 2]
    tx, ty, tz = y * vz - z * vy + w * vx, z * vx - x * vz + w * vy, x * vy - y * vx + w * vz
    twice = 2.0 / (x * x + y * y + z * z + w * w)
    x_turned = vx + twice * (y * tz - z * ty)
    out = np.empty((*x_turned.shape, 3))
    out[..., 0] = x_turned
    out[..., 1] = vy + twice * (z * tx - x * tz)
    out[..., 2] = vz + twice * (x * ty - y * tx)
    return out


def matrices(a: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices (…, 3, 3) of quaternions (…, 4) of any length but zero."""
    return np.swapaxes(rotate(a[..., None, :], np.eye(3)), -1, -2)


def axis_turns() -> NDArray[np.float64]:
    """The 24 rotations that map coordinate axes to coordinate axes, shape (24, 4); signs are chosen so that the last
    non-zero component is positive."""
    halves = np.array(list(product((-1.0, 0.0, 1.0), repeat=4)))
    # non-zero components: one for 0° and 180° about axes, two for 90° and for face diagonals, four for 120°
    count = np.abs(halves).sum(axis=1)
    turns = halves[(count == 1) | (count == 2) | (count == 4)]
    last = np.take_along_axis(turns, 3 - (turns[:, ::-1] != 0.0).argmax(axis=1)[:, None], axis=1)
    return unit(turns[last[:, 0] > 0.0])


def minimal_rotation(start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
    """The smallest rotation that turns direction ``start`` into ``end``, about their common normal.

    For opposite directions, where the axis is not unique, it is ``start`` × the coordinate axis most perpendicular to
    it.
    """
    a, b = np.broadcast_arrays(unit(start), unit(end))
    half = unit(a + b)
    out = np.concatenate([np.cross(a, half), (a * half).sum(-1, keepdims=True)], axis=-1)
    opposite = np.linalg.norm(a + b, axis=-1) < _PARALLEL
    if opposite.any():
        across = np.eye(3)[np.abs(a[opposite]).argmin(axis=-1)]
        out[opposite] = np.concatenate([unit(np.cross(a[opposite], across)), np.zeros((opposite.sum(), 1))], axis=-1)
    return unit(out)


def slerp(times: NDArray[np.float64], rotations: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Spherical linear interpolation along the first axis, the short way; constant before the first and after the last.

    Args:
        times: Increasing times of the K rotations, shape (K,).
        rotations: Unit quaternions, shape (K, …, 4).
        at: Times wanted, shape (F,).

    Returns:
        Unit quaternions, shape (F, …, 4).
    """
    if len(times) == 1:
        return np.repeat(rotations, len(at), axis=0)
    at = np.clip(at, times[0], times[-1])
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    u = ((at - times[k]) / (times[k + 1] - times[k])).reshape(-1, *(1,) * (rotations.ndim - 1))
    a, b = rotations[k], rotations[k + 1]
    cosine = (a * b).sum(-1, keepdims=True)
    b = np.where(cosine < 0.0, -b, b)
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    sine = np.sin(angle)
    near = sine < 1e-6
    safe = np.where(near, 1.0, sine)
    wa = np.where(near, 1.0 - u, np.sin((1.0 - u) * angle) / safe)
    wb = np.where(near, u, np.sin(u * angle) / safe)
    return unit(wa * a + wb * b)
