"""Bounding-volume hierarchy of the triangles of a surface: eight children per node, eight triangles per leaf.

Triangles are split recursively at the median of their centroids along the longest side of their box, down to groups of
eight; eight consecutive groups are the children of a node, and so on up. All groups but the last are full, so the whole
tree is built by sorting rows of arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["TriangleTree", "build_tree", "halved", "join_trees"]

_WIDTH = 8  # children of a node, triangles of a leaf
_MARGIN = np.float32(4e-7)  # margin of the boxes relative to the largest coordinate, against float32 rounding
_NOWHERE = np.float32(1e18)  # corner of an empty box, far from every point


@dataclass(frozen=True, eq=False)
class TriangleTree:
    """Trees in the form that ``warpjld_kernels.triangle_tree.Tree`` describes.

    Attributes:
        root: Root node of every surface's tree, shape (O,).
        child: First child of every node, shape (n,); −1 − leaf where the children are leaves.
        boxes: Lower and upper corners of the children's boxes [m], shape (n, 2, 3, 8).
        corners: Corners of the leaves' triangles [m], shape (leaves, 3, 3, 8).
        face: Indices of these triangles, shape (leaves, 8).
    """

    root: NDArray[np.int32]
    child: NDArray[np.int32]
    boxes: NDArray[np.float32]
    corners: NDArray[np.float32]
    face: NDArray[np.int32]


def build_tree(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> TriangleTree:
    """Build the tree of one surface.

    Args:
        vertices: Positions [m], shape (n, 3).
        faces: Triangles, shape (t, 3), t > 0.
    """
    corner = vertices.astype(np.float32)[faces]
    order = halved(corner.mean(axis=1, dtype=np.float64))
    leaves = -(-len(faces) // _WIDTH)
    # the last leaf is padded with copies of the last triangle
    order = np.concatenate([order, np.repeat(order[-1:], leaves * _WIDTH - len(order))]).reshape(leaves, _WIDTH)
    inside = corner[order]
    margin = _MARGIN * np.abs(corner).max()
    low, high = inside.min(axis=(1, 2)) - margin, inside.max(axis=(1, 2)) + margin
    levels: list[NDArray[np.float32]] = []
    while not levels or len(low) > 1:
        nodes = -(-len(low) // _WIDTH)
        spare = nodes * _WIDTH - len(low)
        lower = np.concatenate([low, np.full((spare, 3), _NOWHERE)]).reshape(nodes, _WIDTH, 3)
        upper = np.concatenate([high, np.full((spare, 3), _NOWHERE)]).reshape(nodes, _WIDTH, 3)
        levels.append(np.stack([lower, upper], axis=1).transpose(0, 1, 3, 2).astype(np.float32))
        filled = np.arange(nodes * _WIDTH).reshape(nodes, _WIDTH, 1) < len(low)
        low = lower.min(axis=1)
        high = np.where(filled, upper, -_NOWHERE).max(axis=1)
    # nodes of the top level first
    child, after = [], 0
    for depth, boxes in enumerate(reversed(levels)):
        count = len(boxes)
        after += count
        last = depth == len(levels) - 1
        child.append(-1 - _WIDTH * np.arange(count) if last else after + _WIDTH * np.arange(count))
    return TriangleTree(
        root=np.zeros(1, dtype=np.int32),
        child=np.concatenate(child).astype(np.int32),
        boxes=np.ascontiguousarray(np.concatenate(levels[::-1])),
        corners=np.ascontiguousarray(inside.transpose(0, 2, 3, 1)),
        face=order.astype(np.int32),
    )


def join_trees(trees: list[TriangleTree]) -> TriangleTree:
    """Concatenate the trees of several surfaces."""
    nodes = np.cumsum([0, *(len(t.child) for t in trees)])
    leaves = np.cumsum([0, *(len(t.face) for t in trees)])
    return TriangleTree(
        root=np.concatenate([t.root + n for t, n in zip(trees, nodes, strict=False)]).astype(np.int32),
        child=np.concatenate(
            [np.where(t.child < 0, t.child - k, t.child + n) for t, n, k in zip(trees, nodes, leaves, strict=False)]
        ).astype(np.int32),
        boxes=np.concatenate([t.boxes for t in trees]),
        corners=np.concatenate([t.corners for t in trees]),
        face=np.concatenate([t.face for t in trees]),
    )


def halved(centre: NDArray[np.float64]) -> NDArray[np.int64]:
    """Order of points (n, 3) by recursive median splits: every aligned group of 8 · 2^k is one side of a split."""
    count = len(centre)
    size = _WIDTH
    while size < count:
        size *= 2
    order = np.arange(size)
    padded = np.concatenate([centre, np.full((size - count, 3), np.inf)])
    while size > _WIDTH:
        rows = order.reshape(-1, size)
        rows = rows[: -(-count // size)]  # the rest is padding
        points = padded[rows]
        finite = np.isfinite(points)
        extent = np.where(finite, points, -np.inf).max(axis=1) - np.where(finite, points, np.inf).min(axis=1)
        along = np.take_along_axis(points, extent.argmax(axis=1)[:, None, None], axis=2)[..., 0]
        cut = np.argpartition(along, size // 2 - 1, axis=1)
        order[: rows.size] = np.take_along_axis(rows, cut, axis=1).ravel()
        size //= 2
    return order[order < count]
