"""Bounding volume hierarchies of a surface's parts, for nearest-triangle queries of the touch kernels."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.triangle_tree import build_tree, join_trees
from warpjld.touch.host_arrays import floats, numbers, starts

__all__ = ["part_trees"]

_NOWHERE = 1e17  # lower bound of boxes in unused child slots of a node [m]


def part_trees(
    vertices: NDArray[np.floating],
    meshes: list[tuple[NDArray[np.int32], NDArray[np.float32]]],
    thickness: NDArray[np.float64],
) -> Any:
    """Build the kernel struct ``touch_trees.PartTrees``; boxes and normals are refitted in every frame.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        meshes: Faces of every part (n, 3), and ``border`` of their corners (n, 3); parts may be empty.
        thickness: Thickness of the flesh [m], shape (V,).
    """
    from warpjld_kernels.touch_trees import FRAME, PartTrees
    from warpjld_kernels.triangle_tree import Tree

    occupied = [k for k, (faces, _) in enumerate(meshes) if len(faces)]
    trees = [build_tree(np.asarray(vertices, dtype=np.float64), meshes[k][0]) for k in occupied]
    joined = join_trees(trees)
    corner, border, real = [], [], []
    for k, own in zip(occupied, trees, strict=True):
        faces, edge = meshes[k]
        corner.append(faces[own.face].transpose(0, 2, 1))
        border.append(edge[own.face].transpose(0, 2, 1))
        valid = np.ones(own.face.size)
        valid[len(faces) :] = 0.0
        real.append(valid)
    nodes = np.zeros(len(meshes), dtype=np.int64)
    nodes[occupied] = [len(own.child) for own in trees]
    root = np.zeros(len(meshes), dtype=np.int32)
    root[occupied] = joined.root
    tree = Tree()
    tree.root, tree.child, tree.face = numbers(root), numbers(joined.child), numbers(joined.face.ravel())
    tree.boxes, tree.corners = floats(joined.boxes.ravel()), floats(joined.corners.ravel())
    corners = np.concatenate(corner)
    out = PartTrees()
    out.tree, out.first_node = tree, starts(nodes)
    out.held = numbers((joined.boxes[:, 0, 0] < _NOWHERE).sum(axis=1))
    out.corner, out.border = numbers(corners.ravel()), floats(np.concatenate(border).ravel())
    out.thickness = floats(thickness[corners].ravel())
    out.units, out.plain = floats(np.zeros(joined.corners.size)), floats(np.ones(joined.face.size))
    out.real = floats(np.concatenate(real))
    out.frames = floats(np.zeros(joined.face.size * FRAME))
    out.framed, out.recent = numbers(np.zeros(len(joined.face))), numbers(np.full(len(meshes), -1))
    return out
