"""Pose-independent data of a surface's parts, as arrays of the touch kernels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.touch.host_arrays import floats, numbers, starts

if TYPE_CHECKING:
    from warpjld.touch.frame import Model

__all__ = ["normal_arrays", "part_arrays"]

_SWELLS = 1.1  # factor of a mesh's largest distance from its bones at rest, to allow for bending


def part_arrays(
    model: Model, vertices: NDArray[np.floating], meshes: list[NDArray[np.int32]], group: NDArray[np.integer]
) -> Any:
    """The kernels' struct ``touch_parts.Parts``.

    Args:
        model: The surface.
        vertices: Rest positions [m], shape (V, 3).
        meshes: Faces of every part.
        group: Round in which every vertex is tested, shape (V,).
    """
    import warp as wp
    from warpjld_kernels.touch_parts import Parts

    patches, names = model.patches, len(model.patches.names)
    corners = [np.unique(f) for f in meshes]
    joined = patches.joined
    empty = np.array([not len(f) for f in meshes], dtype=bool)
    beside = np.full((names, int(joined.sum(axis=1).max())), -1)
    for k, row in enumerate(joined):
        near = np.flatnonzero(row)
        beside[k, : len(near)] = near
    parts = Parts()
    parts.part = numbers(patches.part)
    parts.first_corner = starts([len(c) for c in corners])
    parts.corner = numbers(np.concatenate(corners))
    members = np.bincount(patches.part, minlength=names)
    parts.first_member = starts(members)
    parts.member = numbers(np.argsort(patches.part, kind="stable"))
    parts.group = numbers(group)
    parts.apart = numbers(np.where(joined, 2, np.where(empty[:, None] | empty | model.never, 0, 1)))
    parts.beside = numbers(beside)
    parts.thickness = floats(patches.thickness)
    parts.give = floats(patches.give)
    parts.give_of = floats(np.bincount(patches.part, patches.give, names) / np.maximum(members, 1))
    parts.at_rest = floats(np.zeros(len(vertices)) if model.at_rest is None else model.at_rest)
    parts.facing = 1.0 if model.at_rest is None else 0.0
    parts.edge = floats(model.edge)
    bones = patches.bones if model.joints else ((),) * names
    parts.first_bone = starts([len(of_part) for of_part in bones])
    flat = np.array([pair for of_part in bones for pair in of_part], dtype=np.int32).reshape(-1, 2)
    parts.bone = wp.array(flat, dtype=wp.vec2i, device="cpu")
    parts.around = floats(_SWELLS * model.around)
    return parts


def normal_arrays(vertices: NDArray[np.floating], faces: NDArray[np.int32]) -> Any:
    """The kernels' struct ``touch_normals.Normals`` of a surface, none of them known."""
    import warp as wp
    from warpjld_kernels.touch_normals import Normals

    count = len(vertices)
    order = np.argsort(faces.ravel(), kind="stable")
    around = faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)[order]
    a, b, c = (np.asarray(vertices, dtype=np.float64)[faces[:, k]] for k in range(3))
    areas = [np.bincount(faces.ravel(), np.repeat(n, 3), count) for n in np.cross(b - a, c - a).T]
    out = Normals()
    out.first = starts(np.bincount(faces.ravel(), minlength=count))
    out.around = wp.array(around, dtype=wp.vec2i, device="cpu")
    out.area = floats(np.linalg.norm(areas, axis=0) / 6.0)
    out.known = numbers(np.zeros(count))
    out.normal, out.unit = (wp.zeros(count, dtype=wp.vec3, device="cpu") for _ in range(2))
    out.plain = floats(np.zeros(count))
    return out
