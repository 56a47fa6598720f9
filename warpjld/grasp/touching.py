"""Contact patches of many hands on an object; exact distances are computed only for points that can be in contact."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.near_object import NearObject, NearPoints
from warpjld.grasp.quality.touch import ContactPatches, contact_patches
from warpjld.grasp.segments import SEGMENTS
from warpjld.grasp.subdivided_skin import FinerSkin

__all__ = ["touching_patches"]

_TOGETHER = 16  # hands per batch, which bounds memory
_SLACK = 1e-6  # rounding error of a float32 bound [m]


def touching_patches(
    finer: FinerSkin,
    segments: NDArray[np.int64],
    near: NearObject,
    local: NDArray[np.floating],
    tolerance: float,
) -> tuple[list[ContactPatches], NDArray[np.float64]]:
    """``contact_patches`` by segment of every hand, and the depth of its skin's deepest point in the object [m], (G,).

    Args:
        finer: Sample points of the skin.
        segments: Index into ``SEGMENTS`` of every sample point, shape (n,); -1 for points to be ignored.
        near: The object.
        local: G deformed skins in the object's frame [m], shape (G, V, 3).
        tolerance: Largest distance that counts as contact [m].
    """
    patches: list[ContactPatches] = []
    depths = np.zeros(len(local))
    for first in range(0, len(local), _TOGETHER):
        batch = slice(first, first + _TOGETHER)
        points, hand, row, found = _near_points(finer, near, local[batch], tolerance)
        patches += _patches(finer, segments, near, points, hand, row, found, tolerance)
        np.maximum.at(depths[batch], hand, -found.distance)
    return patches, depths


def _near_points(
    finer: FinerSkin, near: NearObject, skins: NDArray[np.floating], tolerance: float
) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.int64], NearPoints]:
    """Sample points of skins (G, n, 3); hand, row and closest point of the k of them that may touch, each (k,)."""
    points = finer.points(skins)
    # no fine point is farther from its parent than the longest edge there
    coarse = near.at_least(skins, finer.beside) - _SLACK
    hand, row = np.nonzero((coarse <= tolerance)[:, finer.parents])
    return points, hand, row, near.near(points[hand, row], tolerance)


def _patches(
    finer: FinerSkin,
    segments: NDArray[np.int64],
    near: NearObject,
    points: NDArray[np.float32],
    hand: NDArray[np.int64],
    row: NDArray[np.int64],
    found: NearPoints,
    tolerance: float,
) -> list[ContactPatches]:
    """Patches of all hands in one call: (hand, segment) pairs are the parts."""
    count, parts = points.shape[1], len(SEGMENTS)
    close = np.flatnonzero((found.distance <= tolerance) & (segments[row] >= 0))
    faces = np.concatenate(
        [finer.faces[finer.faces_around(row[close[hand[close] == g]])] + g * count for g in range(len(points))]
    )
    used, corners = np.unique(faces, return_inverse=True)
    # points next to those in contact only complete triangles; they stay at infinite distance
    distance, nearest = np.full(len(used), np.inf), np.zeros((len(used), 3))
    outward, part = np.zeros((len(used), 3)), np.full(len(used), -1)
    place = np.searchsorted(used, hand[close] * count + row[close])
    distance[place], nearest[place] = found.distance[close], found.point[close]
    outward[place] = near.thing.normals[found.face[close]]
    part[place] = hand[close] * parts + segments[row[close]]
    every = contact_patches(
        points.reshape(-1, 3)[used],
        corners.reshape(-1, 3),
        part,
        [f"{g} {name}" for g in range(len(points)) for name in SEGMENTS],
        distance,
        nearest,
        outward,
        tolerance=tolerance,
    )
    owner = np.array([int(name.partition(" ")[0]) for name in every.names], dtype=np.int64)
    ends = np.searchsorted(owner, np.arange(len(points) + 1))
    return [_of_hand(every, slice(ends[g], ends[g + 1])) for g in range(len(points))]


def _of_hand(patches: ContactPatches, rows: slice) -> ContactPatches:
    """Patches of one hand, named after their segments."""
    names = tuple(name.partition(" ")[2] for name in patches.names[rows])
    return ContactPatches(
        names,
        patches.points[rows],
        patches.normals[rows],
        patches.skin_normals[rows],
        patches.areas[rows],
        patches.vertices[rows],
    )
