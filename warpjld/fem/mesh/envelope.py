"""A closed triangulated surface with signed distance (R104)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints, Ints32
from warpjld.fem.launch import shared
from warpjld.geometry.rotations import unit
from warpjld.runtime.query_mesh import query_mesh
from warpjld.runtime.threads import in_threads, threads_for

__all__ = ["Envelope", "checked_surface"]


_THREAD = 500
"""Number of points for which another thread is worthwhile."""


@dataclass(frozen=True)
class _Answer:
    distance: Array
    closest: Array
    normal: Array


class Envelope:
    """A triangulated surface that encloses a volume; holes are closed by fans or by the winding number, and reported.

    Args:
        vertices: [m], shape (V, 3).
        faces: Triangles, shape (T, 3).

    Raises:
        InputError: Values that are not finite, indices out of range, or no enclosed volume.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        import warp as wp

        points, triangles = checked_surface(vertices, faces)
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        _, uses = np.unique(edges, axis=0, return_counts=True)
        self.open_edges = int((uses == 1).sum())
        self.crowded_edges = int((uses > 2).sum())
        points, triangles = _capped(points, triangles)
        self.closed = _closed(triangles)
        """Whether the surface, including fans, is closed and consistently oriented, so that inside and outside are
        defined everywhere."""
        corners = points[triangles]
        away = corners - points.mean(axis=0)
        volume = float(np.einsum("ti,ti->", away[:, 0], np.cross(away[:, 1], away[:, 2]))) / 6.0
        if volume < 0:
            triangles, corners = np.ascontiguousarray(triangles[:, ::-1]), corners[:, ::-1]
        self.size = float(np.linalg.norm(np.ptp(points, axis=0)))
        if not abs(volume) > 1e-9 * self.size**3:
            raise InputError("surface: encloses no volume")
        self.volume = abs(volume)
        self.vertices = points
        self.faces = triangles
        self.normals = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        wp.init()
        self._origin = points.mean(axis=0)
        local = ((points - self._origin) / self.size).astype(np.float32)
        self._mesh = query_mesh(local, triangles.reshape(-1, 3), winding=True)

    @property
    def watertight(self) -> bool:
        """Whether every edge has exactly two faces."""
        return self.open_edges == 0 and self.crowded_edges == 0

    def ask(self, points: Array) -> _Answer:
        """Signed distance [m] (negative inside), closest point and surface normal there, for points (n, 3)."""
        import warp as wp
        from warpjld_kernels import fem_inside

        count, mesh = len(points), self._mesh.id
        local = np.ascontiguousarray((points - self._origin) / self.size, dtype=np.float32)
        distance = np.empty(count, np.float32)
        closest = np.empty((count, 3), np.float32)
        face = np.empty(count, np.int32)
        taken = [
            wp.array(local, dtype=wp.vec3, device="cpu", copy=False),
            shared(distance),
            wp.array(closest, dtype=wp.vec3, device="cpu", copy=False),
            shared(face),
        ]

        def span(begin: int, end: int) -> None:
            inputs = [mesh, 10.0, *(values[begin:end] for values in taken)]
            wp.launch(fem_inside.signed_distance, dim=end - begin, inputs=inputs, device="cpu")

        in_threads(span, count, threads_for(count, _THREAD), fem_inside.signed_distance, "cpu")
        return _Answer(
            distance.astype(np.float64) * self.size,
            closest.astype(np.float64) * self.size + self._origin,
            self.normals[np.maximum(face, 0)],
        )


def checked_surface(vertices: ArrayLike, faces: ArrayLike) -> tuple[Array, Ints32]:
    """Vertices (v, 3) and triangles (t, 3) as arrays; InputError for wrong shapes or indices out of range."""
    points = np.ascontiguousarray(vertices, dtype=np.float64)
    triangles = np.ascontiguousarray(faces, dtype=np.int32)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise InputError(f"surface: want finite vertices of shape (n, 3), got {points.shape}")
    if triangles.ndim != 2 or triangles.shape[1] != 3 or len(triangles) == 0:
        raise InputError(f"surface: want triangles of shape (n, 3) with n > 0, got {triangles.shape}")
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError(f"surface: triangle indices must lie in 0…{len(points) - 1}")
    return points, triangles


def _closed(triangles: Ints32) -> bool:
    """Whether every edge is used equally often in both directions."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    count = np.int64(edges.max() + 1)
    _, pair = np.unique(edges.min(axis=1) * count + edges.max(axis=1), return_inverse=True)
    return not np.bincount(pair, np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0)).any()


def _capped(points: Array, triangles: Ints32) -> tuple[Array, Ints32]:
    """Vertices and triangles with a fan over every hole whose border is a simple loop, such as at a cut wrist."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    count = np.int64(len(points))
    open_ = edges[~np.isin(edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0])]
    start, uses = np.unique(open_[:, 0], return_counts=True)
    if not len(open_) or (uses > 1).any() or not np.array_equal(start, np.unique(open_[:, 1])):
        return points, triangles
    onwards = dict(open_.tolist())
    centres: list[Array] = []
    fans: list[Ints] = []
    while onwards:
        first, loop = next(iter(onwards)), []
        here = first
        while here in onwards:
            loop.append(here)
            here = onwards.pop(here)
        ring = np.array(loop)
        centre = np.full(len(ring), len(points) + len(centres))
        centres.append(points[ring].mean(axis=0))
        fans.append(np.stack([np.roll(ring, -1), ring, centre], axis=1))
    closed = np.concatenate([triangles, *fans]).astype(np.int32)
    return np.concatenate([points, centres]), np.ascontiguousarray(closed)
