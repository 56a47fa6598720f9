"""Flattening of skin that lies inside rigid objects onto their surfaces: only the skin is displaced.

A geometric display of contact, as all of TOUCH: no forces are computed, and objects do not move. Contact with forces is
PRESS.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.normals import vertex_normals
from warpjld.geometry.rotations import unit
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.objects import Places
from warpjld.touch.frame import SHARE, fade
from warpjld.touch.touch import Touch, Touched

__all__ = ["flatten_on"]

_CLEARANCE = 0.02  # distance between skin and object relative to the thickness, so that round objects stay hidden
_SOFT = 0.05  # depth, in units of what skin can yield, over which the clearance sets in
_HIGHEST = 0.5  # largest height of a bulge, in the same unit
_WIDE = 4  # smoothing steps, which determine the width of a bulge
_OFTEN = 2  # flattening passes: the second flattens the bulge of the first


def flatten_on(
    touch: Touch, points: NDArray[np.float32], objects: ObjectSet, places: Sequence[Places], *, first: int = 0
) -> tuple[NDArray[np.float32], list[Touched]]:
    """Move skin that is inside objects onto their surfaces.

    Vertices move to the closest point of the object and a little beyond; the volume lost by that bulges beside it. The
    displacement fades out, part by part, with overlaps deeper than skin can yield, which are reported.

    Args:
        touch: Contact of the surface.
        points: Deformed vertices [m], shape (F, V, 3).
        objects: Rigid objects.
        places: F places of every object.
        first: Number of the first frame, for reports.

    Returns:
        The vertices, unchanged to the bit away from objects; and the deepest overlap of every part and frame where it
        is deeper than skin can yield.

    Raises:
        InputError: Numbers of places or vertices that do not match.
    """
    frames, count = points.shape[:2]
    if len(places) != len(objects) or any(len(of_object) != frames for of_object in places):
        raise InputError(f"touch: want {frames} places for each of {len(objects)} objects")
    if count != len(touch.patches.part):
        raise InputError(f"touch: want {len(touch.patches.part)} vertices, got {count}")
    out = np.array(points, dtype=np.float32)
    reported: list[Touched] = []
    for number, of_object in enumerate(places):
        for sweep in range(_OFTEN):
            moved, deep = _flattened(touch, out, objects, number, of_object, first)
            if sweep == 0:
                reported += deep
            changed = np.flatnonzero((moved != out).any(axis=(1, 2)))
            if sweep + 1 < _OFTEN:
                for f in changed.tolist():
                    moved[f] = _bulged(touch, out[f], moved[f])
            out = moved
            if not len(changed):
                break
    return out, reported


def _flattened(
    touch: Touch, points: NDArray[np.float32], objects: ObjectSet, number: int, places: Places, first: int
) -> tuple[NDArray[np.float32], list[Touched]]:
    """Vertices moved out of one object, and overlaps that are too deep."""
    patches = touch.patches
    farthest = 2.0 * float(patches.thickness.max())
    found = objects.distances(points, which=number, places=places, limit=farthest, nearest=True)
    assert found.point is not None
    depth = np.where(found.face >= 0, np.maximum(-found.distance, 0.0), 0.0).astype(np.float64)
    ratio = depth / (SHARE * patches.thickness)
    names = len(patches.names)
    out, reported = points.copy(), []
    for f in np.flatnonzero(depth.any(axis=1)).tolist():
        deepest = np.zeros(names)
        np.maximum.at(deepest, patches.part, ratio[f])
        around = np.where(patches.joined, deepest, 0.0).max(axis=1)
        shown = fade(around)[patches.part] * (patches.give > 0.0)
        inside = np.flatnonzero((depth[f] > 0.0) & (shown > 0.0))
        shift = found.point[f, inside] - points[f, inside]
        length = np.linalg.norm(shift, axis=1)
        beyond = _CLEARANCE * patches.thickness[inside] * np.minimum(ratio[f, inside] / _SOFT, 1.0)
        out[f, inside] += (shown[inside] * (1.0 + beyond / np.maximum(length, 1e-12)))[:, None] * shift
        for part in np.flatnonzero(deepest > 1.0).tolist():
            deep = float(depth[f, patches.part == part].max())
            reported.append(Touched(patches.names[part], objects.objects[number].name, first + f, deep))
    return out, reported


def _bulged(touch: Touch, before: NDArray[np.float32], after: NDArray[np.float32]) -> NDArray[np.float32]:
    """Vertices (V, 3) after a displacement, with the volume it took from each part restored by a bulge around it."""
    patches, smooth = touch.patches, touch.smooth
    shift = after.astype(np.float64) - before
    size = np.linalg.norm(shift, axis=1)
    around_it = size
    for _ in range(_WIDE):
        around_it = smooth @ around_it
    ring = np.clip(around_it - size, 0.0, None) * (patches.give > 0.0)
    faces, names = patches.faces, len(patches.names)
    a, b, c = (before[faces[:, k]].astype(np.float64) for k in range(3))
    turns = np.cross(b - a, c - a) / 6.0
    around = np.stack([np.bincount(faces.ravel(), np.repeat(turns[:, k], 3), len(before)) for k in range(3)], axis=1)
    # perpendicular to the displacement: a bulge towards the object would be flattened again
    away = unit(smooth @ shift)
    normals = vertex_normals(before, faces).astype(np.float64)
    aside = normals - (normals * away).sum(axis=1, keepdims=True) * away
    lost = -np.bincount(patches.part, (around * shift).sum(axis=1), names)
    room = np.bincount(patches.part, np.maximum((around * aside).sum(axis=1), 0.0) * ring, names)
    height = np.where(room > 0.0, lost / np.where(room > 0.0, room, 1.0), 0.0)[patches.part] * ring
    height = np.clip(height, 0.0, _HIGHEST * SHARE * patches.thickness)
    out = after.copy()
    at = height > 0.0
    out[at] += (height[:, None] * aside)[at].astype(np.float32)
    return out
