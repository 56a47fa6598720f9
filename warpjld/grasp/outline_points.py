"""Sample points of an object for penetration tests: its vertices, and points along its sharp edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.grasp.edges import edges_of_sides
from warpjld.grasp.objects import GraspObject

__all__ = ["outline_points"]

_SHARP = np.cos(np.radians(10.0))  # cosine of the angle between face normals from which an edge is sharp


def outline_points(thing: GraspObject, spacing: float = 2e-3) -> NDArray[np.float64]:
    """The vertices, and points along sharp edges at most ``spacing`` [m] apart, in the object's frame, shape (n, 3).

    An edge is sharp where the normals of its faces differ by 10° or more, or where it does not have exactly two faces.
    Flat regions need no further points: contact there is detected by the other surface's vertices.
    """
    first, place, uses = edges_of_sides(thing.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2))
    total = np.zeros((len(first), 3))
    np.add.at(total, place, np.repeat(thing.normals, 3, axis=0))
    # |n₁ + n₂|² = 2 + 2 cos
    sharp = (uses != 2) | ((total**2).sum(axis=1) < 2.0 + 2.0 * _SHARP)
    a, b = thing.vertices[first[sharp, 0]], thing.vertices[first[sharp, 1]]
    pieces = np.ceil(np.linalg.norm(b - a, axis=1) / spacing).astype(int)
    between = [thing.vertices]
    for count in np.unique(pieces[pieces > 1]).tolist():
        own = pieces == count
        part = (np.arange(1, count) / count)[None, :, None]
        between.append((a[own, None] * (1.0 - part) + b[own, None] * part).reshape(-1, 3))
    return np.concatenate(between)
