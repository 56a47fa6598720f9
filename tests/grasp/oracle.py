"""Signed distances by brute force in float64: every triangle, and the sum of all solid angles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.winding import winding_numbers
from warpjld.grasp.objects import GraspObject


def signed_distance(points: NDArray, thing: GraspObject) -> NDArray[np.float64]:
    """Distances [m] in the object's frame, negative where the surface winds more than half round."""
    unsigned = np.array([_to_triangles(p, thing.vertices[thing.faces]).min() for p in points])
    return np.where(winding_numbers(thing.vertices, thing.faces, points) > 0.5, -unsigned, unsigned)


def _to_triangles(p: NDArray, corner: NDArray) -> NDArray[np.float64]:
    """Distances of a point to triangles (t, 3, 3): to the plane where its foot is inside, else to the edges."""
    best = np.full(len(corner), np.inf)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    inside = np.ones(len(corner), dtype=bool)
    for k in range(3):
        start, edge = corner[:, k], corner[:, (k + 1) % 3] - corner[:, k]
        t = np.clip(((p - start) * edge).sum(1) / (edge**2).sum(1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(p - start - t[:, None] * edge, axis=1))
        inside &= (np.cross(edge, p - start) * normal).sum(1) >= 0.0
    height = np.abs(((p - corner[:, 0]) * normal).sum(1)) / np.linalg.norm(normal, axis=1)
    return np.where(inside, np.minimum(best, height), best)
