"""Midpoint subdivision, and how much a deformation stretches edges."""

from __future__ import annotations

import numpy as np

from warpjld.covering import Covering
from warpjld.geometry.surface import Surface, weld_surface
from warpjld.skeleton import Poses


def edges(faces: np.ndarray) -> np.ndarray:
    """Every edge once, shape (E, 2)."""
    return np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)


def subdivided(surface: Surface) -> Surface:
    """Every triangle cut into four at the middle of its edges: the same shape, finer."""
    count, faces = len(surface.vertices), surface.faces.astype(np.int64)
    ends = edges(faces)
    middles = surface.vertices[ends].mean(axis=1)
    key = ends[:, 0] * count + ends[:, 1]

    def middle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return count + np.searchsorted(key, np.minimum(a, b) * count + np.maximum(a, b))

    a, b, c = faces.T
    ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
    finer = np.concatenate([np.column_stack(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return weld_surface(np.concatenate([surface.vertices, middles]), finer, tolerance=0.0)


def stretches(covering: Covering, poses: Poses) -> np.ndarray:
    """Final length over rest length of every edge, the largest over the poses, shape (E,)."""
    ends = edges(covering.surface.faces)
    rest = np.linalg.norm(np.diff(covering.surface.vertices[ends], axis=1)[:, 0], axis=1)
    largest = np.zeros(len(ends))
    for _, block in covering.blocks(poses, frames=4):
        for frame in block:
            moved = frame[ends[:, 1]].astype(np.float64) - frame[ends[:, 0]]
            largest = np.maximum(largest, np.linalg.norm(moved, axis=1) / rest)
    return largest
