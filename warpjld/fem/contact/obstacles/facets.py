"""Closest-point projection onto a triangulated surface in double precision, with smooth normals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32, Mask
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Points
from warpjld.fem.mesh.envelope import checked_surface
from warpjld.runtime.query_mesh import query_mesh
from warpjld.runtime.threads import in_threads, threads_for

__all__ = ["CREASE", "Facets", "Place"]

CREASE = np.radians(40.0)
"""Dihedral angle above which an edge is a sharp feature of the body, and not due to its discretisation [rad]."""

_SURE = 1e-5
"""Distance, over the size, above which the winding number (in single precision) decides inside or outside."""

_THREAD = 5_000
"""Smallest number of points per thread."""


@dataclass(frozen=True, eq=False)
class Place:
    """Closest points as positions on the surface.

    Attributes:
        face: Triangle of each point, shape (n,).
        weights: Barycentric coordinates in it, shape (n, 3).
    """

    face: Ints32
    weights: Array


class Facets:
    """A triangulated surface with movable vertices.

    Distances are exact for the facets: Warp's bounding volume hierarchy finds the triangle in single precision, the
    rest is computed in double precision. Normals are interpolated from angle-weighted corner normals, split at creases;
    on a crease they point along the line between point and surface.

    Args:
        vertices: [m], shape (v, 3).
        faces: Triangles, anticlockwise seen from outside, shape (t, 3); reversed if they enclose a negative volume
            (an open surface, with the cone from its middle to its rim).

    Raises:
        InputError: Not finite, wrong shapes, indices out of range, or only triangles without area.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        points, triangles = checked_surface(vertices, faces)
        corners = points[triangles]
        corners = corners - corners.mean(axis=(0, 1))  # what an open surface encloses depends on the origin
        if np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) < 0.0:
            triangles = np.ascontiguousarray(triangles[:, ::-1])
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        triangles = triangles[area > 1e-14 * area.max()]
        if not len(triangles):
            raise InputError("surface: no triangle has an area")
        self.faces = triangles
        self._neighbours = _neighbours(triangles)
        self._mesh: Any = None
        self._soft, self._groups = np.empty(0, dtype=bool), np.empty((0, 3), dtype=np.int64)
        self.move(points)

    def move(self, vertices: Array, normals: Array | None = None) -> None:
        """Set the vertices [m], shape (v, 3), and optionally exact normals of the triangles' corners, of any length,
        shape (t, 3, 3)."""
        import warp as wp

        self.vertices = vertices
        self.size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
        self._origin = vertices.mean(axis=0)
        self._features(normals)
        local = wp.array(self._local(vertices), dtype=wp.vec3, device="cpu")
        # a new hierarchy: one refitted after large deformation makes queries slow
        self._mesh = query_mesh(local, self.faces, winding=True)

    def project(self, points: Points) -> ClosestPoints:
        """Signed distances, closest points and normals of points (n, 3) [m]."""
        return self.locate(points)[0]

    def locate(self, points: Points) -> tuple[ClosestPoints, Place]:
        """As ``project``, with the triangles and barycentric coordinates of the closest points."""
        face, inside = self._nearest(points)
        weights = _closest_weights(self.vertices[self.faces[face]], points)
        place = Place(face, weights)
        closest = self.at(place, self.vertices)
        away = points - closest
        reach = np.linalg.norm(away, axis=1)
        normal, feature = self._normals(place)
        # near the surface the pseudonormal of the facet, edge or corner decides; elsewhere the winding number, which
        # also accounts for other parts of the same surface
        beyond = np.einsum("ni,ni->n", away, feature) >= 0.0
        outside = np.where(reach < _SURE * self.size, beyond, ~inside)
        distance = np.where(outside, reach, -reach)
        sharp = self._on_crease(place) & (reach > 1e-9 * self.size)
        normal[sharp] = away[sharp] / distance[sharp, None]
        return ClosestPoints(distance, closest, normal), place

    def at(self, place: Place, vertices: Array) -> Points:
        """Positions of places for given vertices [m], shape (n, 3)."""
        out: Points = np.einsum("nk,nki->ni", place.weights, vertices[self.faces[place.face]])
        return out

    def carried(self, points: Points, vertices: Array) -> Points:
        """Points (n, 3) [m] carried along when the surface's vertices move to ``vertices``; the offset of a point from
        its nearest facet rotates with it."""
        found, place = self.locate(points)
        offset = np.einsum("nij,nj->ni", self.frames(place, self.vertices), points - found.closest)
        return np.asarray(self.at(place, vertices) + np.einsum("nij,ni->nj", self.frames(place, vertices), offset))

    def frames(self, place: Place, vertices: Array) -> Array:
        """Orthonormal frames of the triangles of places for given vertices; rows are the first edge, the normal and
        their cross product, shape (n, 3, 3)."""
        a, b, c = np.moveaxis(vertices[self.faces[place.face]], 1, 0)
        x = (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True)
        y = np.cross(b - a, c - a)
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        return np.stack([x, y, np.cross(x, y)], axis=1)

    def _local(self, points: Points) -> NDArray[np.float32]:
        return np.ascontiguousarray((points - self._origin) / self.size, dtype=np.float32)

    def _nearest(self, points: Points) -> tuple[Ints32, Mask]:
        """Nearest triangles (n,), and mask of points inside (n,), in single precision."""
        import warp as wp
        from warpjld_kernels import fem_inside

        count = len(points)
        local = self._local(points)
        distance, closest = np.empty(count, np.float32), np.empty((count, 3), np.float32)
        face = np.empty(count, np.int32)
        reach = 10.0 + 2.0 * float(np.abs(local).max(initial=0.0))

        def span(begin: int, end: int) -> None:
            piece = slice(begin, end)
            inputs = [self._mesh.id, reach, wp.array(local[piece], dtype=wp.vec3, device="cpu", copy=False)]
            outputs = [
                wp.array(distance[piece], dtype=float, device="cpu", copy=False),
                wp.array(closest[piece], dtype=wp.vec3, device="cpu", copy=False),
                wp.array(face[piece], dtype=wp.int32, device="cpu", copy=False),
            ]
            wp.launch(fem_inside.signed_distance, dim=end - begin, inputs=[*inputs, *outputs], device="cpu")

        in_threads(span, count, threads_for(count, _THREAD), fem_inside.signed_distance, "cpu")
        return np.maximum(face, 0), distance < 0.0

    def _features(self, normals: Array | None) -> None:
        """Pseudonormals of triangles, edges and corners, corner normals, and creases."""
        x = self.vertices[self.faces]
        flat = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
        other = np.where(self._neighbours >= 0, self._neighbours, np.arange(len(flat))[:, None])
        soft = (np.einsum("ti,tki->tk", flat, flat[other]) > np.cos(CREASE)) & (self._neighbours >= 0)
        self._sharp_edge = ~soft
        sharp = np.zeros(len(self.vertices), dtype=bool)
        for k in range(3):  # edge k lies opposite corner k
            for end in ((k + 1) % 3, (k + 2) % 3):
                sharp[self.faces[~soft[:, k], end]] = True
        self._sharp_corner = sharp[self.faces]
        angles = _angles(x)
        around = _summed(self.faces.T.ravel(), angles.T[:, :, None] * flat, len(self.vertices))
        # pseudonormals: only their direction matters
        self._feature = np.concatenate([flat[:, None], flat[:, None] + flat[other], around[self.faces]], axis=1)
        if normals is None:
            if not np.array_equal(soft, self._soft):
                self._soft, self._groups = soft, _smooth_corners(self.faces, soft, self._neighbours)
            label = self._groups
            normals = _summed(label.T.ravel(), angles.T[:, :, None] * flat, int(label.max()) + 1)[label]
        length = np.linalg.norm(normals, axis=2, keepdims=True)
        self.corner_normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), flat[:, None])

    def _normals(self, place: Place) -> tuple[Points, Points]:
        """Smooth unit normals, and pseudonormals of the features that places lie on, for the sign of the distance."""
        smooth = np.einsum("nk,nki->ni", place.weights, self.corner_normals[place.face])
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        flat = self._feature[place.face, 0]
        smooth = np.where(length > 1e-6, smooth / np.maximum(length, 1e-6), flat)
        zero = place.weights <= 0.0
        count = zero.sum(axis=1)
        which = np.where(count == 1, 1 + zero.argmax(axis=1), np.where(count == 2, 4 + (~zero).argmax(axis=1), 0))
        return smooth, self._feature[place.face, which]

    def _on_crease(self, place: Place) -> Mask:
        """Mask of places on a sharp edge or corner, shape (n,)."""
        zero = place.weights <= 0.0
        count = zero.sum(axis=1)
        edge = self._sharp_edge[place.face, zero.argmax(axis=1)]
        corner = self._sharp_corner[place.face, (~zero).argmax(axis=1)]
        return np.asarray(((count == 1) & edge) | ((count == 2) & corner))


def _neighbours(faces: Ints32) -> Ints:
    """Triangle across the edge opposite each corner, −1 at boundary and non-manifold edges, shape (t, 3)."""
    edges = faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2).astype(np.int64)
    key = edges.min(axis=1) * (edges.max() + 1) + edges.max(axis=1)
    _, label, uses = np.unique(key, return_inverse=True, return_counts=True)
    order = np.argsort(label, kind="stable")
    out = np.full(len(label), -1, dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(uses)[:-1]])[uses == 2]
    one, two = order[first], order[first + 1]
    out[one], out[two] = two // 3, one // 3
    return out.reshape(-1, 3)


def _smooth_corners(faces: Ints32, soft: Mask, neighbours: Ints) -> Ints:
    """Smoothing group of each triangle corner, shape (t, 3): the same for triangles around a vertex that are connected
    without crossing a crease."""
    links = []
    for k in range(3):
        mine = np.flatnonzero(soft[:, k])
        other = neighbours[mine, k]
        for end in ((k + 1) % 3, (k + 2) % 3):
            place = (faces[other] == faces[mine, end][:, None]).argmax(axis=1)
            links.append(np.stack([3 * mine + end, 3 * other + place]))
    one, two = np.concatenate(links, axis=1)
    graph = coo_array((np.ones(len(one)), (one, two)), shape=(faces.size, faces.size))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64).reshape(-1, 3)


def _angles(x: Array) -> Array:
    """Angles at the corners of triangles (t, 3, 3) [rad], shape (t, 3)."""
    ahead, back = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(ahead, back), axis=2), (ahead * back).sum(axis=2)))


def _summed(label: NDArray[np.integer], vectors: Array, count: int) -> Array:
    """Sums of vectors by label, shape (count, 3)."""
    flat = vectors.reshape(-1, 3)
    return np.stack([np.bincount(label, flat[:, axis], minlength=count) for axis in range(3)], axis=1)


def _closest_weights(triangles: Array, points: Points) -> Array:
    """Barycentric coordinates (n, 3) of the closest points on triangles (n, 3, 3), exactly zero off edges and corners
    that they lie on (Ericson, Real-Time Collision Detection, §5.1.5)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, ac = b - a, c - a
    d1, d2 = _dot(ab, points - a), _dot(ac, points - a)
    d3, d4 = _dot(ab, points - b), _dot(ac, points - b)
    d5, d6 = _dot(ab, points - c), _dot(ac, points - c)
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    out = np.zeros((len(points), 3))
    with np.errstate(divide="ignore", invalid="ignore"):
        total = va + vb + vc
        v, w = vb / total, vc / total
        inner = np.stack([1.0 - v - w, v, w], axis=1)
        on_ab, on_ac, on_bc = d1 / (d1 - d3), d2 / (d2 - d6), (d4 - d3) / ((d4 - d3) + (d5 - d6))
    zero = np.zeros(len(points))
    cases = [
        ((d1 <= 0) & (d2 <= 0), (1.0 + zero, zero, zero)),
        ((d3 >= 0) & (d4 <= d3), (zero, 1.0 + zero, zero)),
        ((d6 >= 0) & (d5 <= d6), (zero, zero, 1.0 + zero)),
        ((vc <= 0) & (d1 >= 0) & (d3 <= 0), (1.0 - on_ab, on_ab, zero)),
        ((vb <= 0) & (d2 >= 0) & (d6 <= 0), (1.0 - on_ac, zero, on_ac)),
        ((va <= 0) & (d4 >= d3) & (d5 >= d6), (zero, 1.0 - on_bc, on_bc)),
    ]
    todo = np.ones(len(points), dtype=bool)
    for where, weights in cases:
        chosen = todo & where
        out[chosen] = np.stack([w[chosen] for w in weights], axis=1)
        todo &= ~chosen
    out[todo] = inner[todo]
    return out


def _dot(a: Points, b: Points) -> Array:
    return np.asarray((a * b).sum(axis=1))
