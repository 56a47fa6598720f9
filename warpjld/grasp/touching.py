"""Patches of contact of a skin and an object, from the points that are near enough only."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.finer import FinerSkin
from warpjld.grasp.near_object import NearObject
from warpjld.grasp.quality.touch import ContactPatches, contact_patches
from warpjld.grasp.segments import SEGMENTS

__all__ = ["touching_patches"]


def touching_patches(
    finer: FinerSkin,
    segments: NDArray[np.int64],
    near: NearObject,
    local: NDArray[np.floating],
    tolerance: float,
) -> tuple[ContactPatches, float]:
    """``contact_patches`` by segment of the hand, and the depth of the skin's deepest point in the object [m].

    Args:
        finer: The skin's points.
        segments: Place in ``SEGMENTS`` of every such point, shape (n,); -1 where it is of no interest.
        near: The object.
        local: A deformed skin in the object's frame [m], shape (V, 3).
        tolerance: Largest distance that counts as contact [m].
    """
    points = finer.points(local)
    found = near.near(points, tolerance)
    touching = np.flatnonzero((found.distance <= tolerance) & (segments >= 0))
    used, corners = np.unique(finer.faces[finer.faces_around(touching)], return_inverse=True)
    patches = contact_patches(
        points[used],
        corners.reshape(-1, 3),
        # those beside have not all their triangles here
        np.where(np.isin(used, touching), segments[used], -1),
        SEGMENTS,
        found.distance[used],
        found.point[used],
        near.thing.normals[found.face[used]],
        tolerance=tolerance,
    )
    return patches, max(0.0, -float(found.distance.min()))
