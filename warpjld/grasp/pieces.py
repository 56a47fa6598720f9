"""Cutting of an object into slices, which bonds may hold together (B §3.2, R101, R102)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.validation import mend

__all__ = ["cut_object", "longest_axis"]

_SLAB = {"box": (0, 1, 2), "cylinder": (1,)}
"""Axes of built-in shapes along which a slice is a shape of the same kind."""


def longest_axis(thing: GraspObject) -> int:
    """Index (0, 1, 2) of the axis of an object's own frame along which it is longest."""
    return int(np.argmax(np.round(thing.size, 9)))


def cut_object(thing: GraspObject, count: int, axis: int) -> list[GraspObject]:
    """Cut an object into slices of equal thickness, in ascending order; all keep its frame and placement.

    Args:
        thing: The object; its surface must be closed.
        count: Count of slices, 2 or more.
        axis: Axis of the object's own frame, normal to the cuts.

    Raises:
        InputError: The surface is not closed, or a slice is empty.
    """
    if count < 2:
        raise InputError(f"pieces: want 2 or more, got {count}")
    if not thing.report.watertight:
        raise InputError(f"{thing.name} has an open surface: only closed ones can be cut")
    low, high = float(thing.vertices[:, axis].min()), float(thing.vertices[:, axis].max())
    ends = np.linspace(low, high, count + 1)
    out = []
    for number, (a, b) in enumerate(pairwise(ends), 1):
        planes = [(a, 1.0)] * (number > 1) + [(b, -1.0)] * (number < count)
        vertices, faces = _between(thing, axis, planes)
        if not len(faces):
            raise InputError(f"piece {number} of {thing.name} would be empty")
        mended = mend(vertices, faces)
        origin = thing.origin if axis in _SLAB.get(thing.origin, ()) else ""
        piece = replace(
            thing, vertices=mended.vertices, faces=mended.faces, report=mended.report, origin=origin, numbers=None
        )
        out.append(replace(piece, name=f"{thing.name}_{number}", facets=None, cells=None, paint=None))
    return out


def _between(
    thing: GraspObject, axis: int, planes: Sequence[tuple[float, float]]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices and triangles of an object clipped by planes (height along the axis, sign of the kept side), capped."""
    import pyvista

    mesh = pyvista.PolyData.from_regular_faces(thing.vertices, thing.faces)
    for height, side in planes:
        origin, normal = np.zeros(3), np.zeros(3)
        origin[axis], normal[axis] = height, side
        mesh = mesh.clip_closed_surface(normal=normal, origin=origin).triangulate().clean()
    if mesh.n_cells == 0:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int32)
    return np.asarray(mesh.points, dtype=np.float64), np.asarray(mesh.regular_faces, dtype=np.int32)
