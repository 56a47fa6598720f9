"""Distance process of paper A: coordinates of points in the basis of a chosen facet (A §7.1, R73)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.grasp.distance import finite_points
from warpjld.grasp.objects import GraspObject, Places

__all__ = ["FacetDistances", "facet_axes", "facet_distance", "inside_facets"]


@dataclass(frozen=True, eq=False)
class FacetDistances:
    """Points in a facet's basis (A §7, R73).

    Attributes:
        coordinates: x along the facet's first edge, y along its normal, z = x × y [m], shape (…, 3). y is the
            signed distance to its plane, negative behind the facet; x and z are the lateral position.
        inside: Whether the foot of the perpendicular lies in the facet, borders included, shape (…) (C19).
    """

    coordinates: NDArray[np.float64]
    inside: NDArray[np.bool_]

    @property
    def distance(self) -> NDArray[np.float64]:
        """Signed distance to the facet's plane [m], shape (…)."""
        return np.asarray(self.coordinates[..., 1])


def facet_distance(points: ArrayLike, thing: GraspObject, facet: int, place: Places | None = None) -> FacetDistances:
    """Coordinates of world points in a facet's basis.

    Args:
        points: World positions [m], shape (n, 3) or (sets, n, 3).
        thing: The object.
        facet: Triangle, a row of ``thing.faces``; ``thing.triangles_of`` converts the file's facet numbers.
        place: One placement; the object's own if left out.

    Raises:
        InputError: No such facet, wrong shapes, or points that are not finite.
    """
    stage = finite_points(points)
    where = thing.place if place is None else place
    corners = thing.vertices[thing.faces[thing.check_facet(facet)]][None]
    local = where.to_local(stage.reshape(-1, 3))[0] - corners[0, 0]
    coordinates = local @ facet_axes(corners)[0].T
    inside = inside_facets(corners, coordinates[:, [0, 2]], slack=1e-12)
    return FacetDistances(coordinates.reshape(stage.shape), inside.reshape(stage.shape[:-1]))


def facet_axes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bases (n, 3, 3) of triangles with corners (n, 3, 3): rows x along the first edge, y the normal, z = x × y."""
    edge = corners[:, 1] - corners[:, 0]
    x = edge / np.linalg.norm(edge, axis=1, keepdims=True)
    y = np.cross(edge, corners[:, 2] - corners[:, 0])
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def inside_facets(corners: NDArray[np.float64], feet: NDArray[np.floating], *, slack: float) -> NDArray[np.bool_]:
    """Whether feet of perpendiculars lie in triangles, borders included (C19).

    Args:
        corners: Of one triangle, shape (1, 3, 3), or of one for every foot, shape (n, 3, 3) [m].
        feet: Lateral coordinates x and z in the triangle's basis, its first corner the origin [m], shape (n, 2).
        slack: Width of the border relative to the triangle's longest side: the precision of the feet.

    Returns:
        Shape (n,).
    """
    axes = facet_axes(corners)[:, [0, 2]]
    flat = np.einsum("nki,nji->nkj", corners - corners[:, :1], axes)
    size = np.linalg.norm(flat - np.roll(flat, 1, axis=1), axis=2).max(axis=1)
    inside = np.ones(len(feet), dtype=bool)
    for k in range(3):
        start, side = flat[:, k], flat[:, (k + 1) % 3] - flat[:, k]
        # clockwise seen along y, since z = x × y
        outwards = side[:, 0] * (feet - start)[:, 1] - side[:, 1] * (feet - start)[:, 0]
        inside &= outwards <= slack * size * np.linalg.norm(side, axis=1)
    return inside
