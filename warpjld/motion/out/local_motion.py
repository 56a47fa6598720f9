"""Decomposition of world transforms into translation, rotation and scale relative to parents, for glTF and USD."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

__all__ = ["LocalMotion", "local_motion", "rest_scales"]

_FLAT = 1e-9  # smallest scale relative to the largest; below, the transform counts as singular
_SQUARE = 1e-6  # largest deviation from a rotation that is not corrected


@dataclass(frozen=True, eq=False)
class LocalMotion:
    """f frames of N nodes; their scale is constant, that of ``rest_scales``.

    Attributes:
        translations: Shape (f, N, 3).
        rotations: Unit quaternions x, y, z, w of any sign, shape (f, N, 4).
        sheared: Largest part of each node's transform that these cannot represent, relative to its scale, shape (N,).
    """

    translations: NDArray[np.float64]
    rotations: NDArray[np.float64]
    sheared: NDArray[np.float64]


def rest_scales(local: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale of node-to-parent transforms (N, 4, 4), shape (N, 3); the first is negative for mirroring ones."""
    linear = local[:, :3, :3]
    scales = np.linalg.norm(linear, axis=1)
    scales[np.linalg.det(linear) < 0.0, 0] *= -1.0
    return np.asarray(scales)


def local_motion(
    worlds: NDArray[np.float64],
    parents: NDArray[np.int64],
    rest: NDArray[np.float64],
    scales: NDArray[np.float64],
    given: NDArray[np.bool_],
) -> LocalMotion:
    """Decompose transforms relative to the parent.

    A node is placed relative to the decomposed transform of its parent, so that positions are exact even where shear is
    lost (rotation below a parent with non-uniform scale).

    Args:
        worlds: Node-to-world transforms, shape (f, N, 4, 4); ignored for nodes that are not ``given``.
        parents: Parent of every node, -1 for none; in any order, shape (N,).
        rest: Node-to-parent transforms at rest, shape (N, 4, 4).
        scales: Scale in ``rest``, shape (N, 3); where one is 0 the rotation stays as at rest.
        given: Mask of nodes that ``worlds`` moves, shape (N,); others stay at rest relative to their parent.
    """
    frames, count = worlds.shape[:2]
    shown = np.empty((frames, count, 4, 4))
    out = LocalMotion(np.empty((frames, count, 3)), np.empty((frames, count, 4)), np.zeros(count))
    flat = ~(np.abs(scales).min(axis=1) > _FLAT * np.abs(scales).max(axis=1))
    safe = np.where(flat[:, None], 1.0, scales)
    at_rest = [np.eye(3) if flat[n] else nearest_rotations(rest[None, n, :3, :3] / safe[n])[0] for n in range(count)]
    lost = np.zeros(count, dtype=bool)
    for node in _parents_first(parents):
        parent = int(parents[node])
        lost[node] = flat[node] or (parent >= 0 and lost[parent])
        local = np.repeat(rest[node][None], frames, axis=0)
        if given[node] and not (parent >= 0 and lost[parent]):
            local = worlds[:, node] if parent < 0 else np.linalg.solve(shown[:, parent], worlds[:, node])
        turns = np.repeat(at_rest[node][None], frames, axis=0)
        if not flat[node]:
            turns = nearest_rotations(local[:, :3, :3] / safe[node])
        written = Rotation.from_matrix(turns)
        kept = local.copy()
        kept[:, :3, :3] = written.as_matrix() * scales[node]
        out.translations[:, node] = local[:, :3, 3]
        out.rotations[:, node] = written.as_quat()
        size = float(np.abs(scales[node]).max()) or 1.0
        out.sheared[node] = np.abs(kept[:, :3, :3] - local[:, :3, :3]).max() / size
        shown[:, node] = kept if parent < 0 else shown[:, parent] @ kept
    return out


def nearest_rotations(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest rotations to matrices, shape (f, 3, 3) (polar decomposition)."""
    off = np.abs(matrices @ matrices.swapaxes(-1, -2) - np.eye(3)).max()
    if off < _SQUARE and (np.linalg.det(matrices) > 0.0).all():
        return matrices
    u, _, vt = np.linalg.svd(matrices)
    u[np.linalg.det(u @ vt) < 0.0, :, 2] *= -1.0
    return np.asarray(u @ vt)


def _parents_first(parents: NDArray[np.int64]) -> list[int]:
    order: list[int] = []
    children: dict[int, list[int]] = {}
    for node, parent in enumerate(parents.tolist()):
        children.setdefault(parent, []).append(node)
    waiting = children.get(-1, [])
    while waiting:
        node = waiting.pop()
        order.append(node)
        waiting.extend(children.get(node, ()))
    return order
