"""Self-penetration depth of a hand: digits and palm inside one another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from warpjld.covering import Covering
from warpjld.geometry.normals import vertex_normals
from warpjld.grasp.covering_cache import kept_with
from warpjld.grasp.objects import Places
from warpjld.grasp.posed_skins import PosedSkins

__all__ = ["self_penetration"]

Array = NDArray[np.float64]

_OFF = 1e-5  # offset along the normal, out of its own skin, of a vertex that is tested against other parts [m]
_TOGETHER = 200_000  # pairs of points and triangles per batch


def self_penetration(covering: Covering, vertices: NDArray[np.floating]) -> float:
    """Depth of the deepest vertex of one digit, or of the palm, in another part of the hand [m]; 0 where none is.

    Where triangles of two parts pass through one another, a vertex p of one with outward normal n is inside the other
    if the closed skin winds round p + 10 µm n, and its depth is its distance to the other's skin,

        depth = max over parts A, B that cross, p of A inside:  min over x on the skin of B  ‖p − x‖.

    DexGraspNet (Wang et al. 2023) tests spheres at keypoints instead; here every vertex of the skin counts. Folds
    within one part are ignored.

    Args:
        covering: The hand.
        vertices: Its deformed skin [m], shape (V, 3).
    """
    posed = kept_with(covering, PosedSkins)
    crossing = posed.crossings(vertices[None])[0]
    if not crossing.any():
        return 0.0
    points, faces = np.asarray(vertices, dtype=np.float64), covering.surface.faces
    normals = vertex_normals(vertices, faces).astype(np.float64)
    owned = [np.unique(faces[posed.parts.of_face == part]) for part in range(len(posed.parts.names))]
    skin = posed.fitted(vertices[None], Places.of())
    deepest = 0.0
    for part in np.flatnonzero(crossing.any(axis=1)).tolist():
        asked = owned[part]
        inside = asked[posed.distances(skin, points[asked] + _OFF * normals[asked], np.inf)[0] < 0.0]
        for other in np.flatnonzero(crossing[part]).tolist():
            # vertices on the border of two parts belong to both
            own = inside[~np.isin(inside, owned[other])]
            near = _distances(points[own], points[faces[posed.parts.of_face == other]])
            # a point may be inside a third part and far from this one: count it only where this part is the nearest
            mine = _distances(points[own], points[faces[~np.isin(posed.parts.of_face, [part, other])]])
            deepest = max(deepest, float(near[near <= mine].max(initial=0.0)))
    return deepest


def _distances(points: Array, triangles: Array) -> Array:
    """Distance of each point (n, 3) to the nearest of triangles (t, 3, 3), shape (n,); infinite without triangles."""
    from trimesh.triangles import closest_point

    found = np.full(len(points), np.inf)
    step = max(1, _TOGETHER // max(len(triangles), 1))
    for first in range(0, len(points) if len(triangles) else 0, step):
        batch = points[first : first + step]
        pairs = np.repeat(batch, len(triangles), axis=0)
        nearest = closest_point(np.tile(triangles, (len(batch), 1, 1)), pairs)
        gaps = np.linalg.norm(nearest - pairs, axis=1).reshape(len(batch), -1)
        found[first : first + step] = gaps.min(axis=1)
    return found
