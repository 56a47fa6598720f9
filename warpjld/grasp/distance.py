"""How far points are from objects: to a chosen facet's plane (R73), or to the nearest point of the surface (C19)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering.device import checked_device
from warpjld.errors import InputError
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.triangle_tree import build_tree, join_trees

__all__ = ["Distances", "FacetDistances", "ObjectSet", "facet_basis", "facet_distance", "feature_normals"]

_SPLIT_BELOW = 2_000  # points a thread must have before splitting pays


@dataclass(frozen=True, eq=False)
class FacetDistances:
    """Points in a facet's basis (A §7, R73).

    Attributes:
        coordinates: x along the facet's first edge, y along its normal, z = x × y [m], shape (…, 3). y is the
            distance: negative behind the facet; x and z are the lateral place.
        inside: Whether the foot of the perpendicular lies in the facet, borders included, shape (…) (C19).
    """

    coordinates: NDArray[np.float64]
    inside: NDArray[np.bool_]

    @property
    def distance(self) -> NDArray[np.float64]:
        """Signed distance to the facet's plane [m]."""
        return np.asarray(self.coordinates[..., 1])


@dataclass(frozen=True, eq=False)
class Distances:
    """Nearest points of surfaces.

    Attributes:
        distance: Signed distance [m], negative inside, shape (R, n); +inf where nothing lies within the limit.
        face: Nearest triangle, -1 where there is none, shape (R, n).
        point: Nearest points on the stage [m], shape (R, n, 3), or None where they were not asked for.
    """

    distance: NDArray[np.float32]
    face: NDArray[np.int32]
    point: NDArray[np.float32] | None


def facet_basis(thing: GraspObject, facet: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origin (a corner) and rows x, y, z of a facet's basis in the object's frame (A §7, R73).

    Raises:
        InputError: There is no such facet.
    """
    corner = thing.vertices[thing.faces[thing.check_facet(facet)]]
    x = corner[1] - corner[0]
    x = x / np.linalg.norm(x)
    y = thing.normals[facet]
    return corner[0], np.stack([x, y, np.cross(x, y)])


def facet_distance(points: ArrayLike, thing: GraspObject, facet: int, place: Places | None = None) -> FacetDistances:
    """Distance process (A §7.1): points represented in a facet's basis.

    Args:
        points: On the stage [m], shape (n, 3).
        thing: The object.
        facet: Row of its faces.
        place: One placement; the object's own if left out.

    Raises:
        InputError: No such facet, wrong shapes, or points that are not finite.
    """
    stage = _finite_points(points)
    where = thing.place if place is None else place
    origin, axes = facet_basis(thing, facet)
    local = where.to_local(stage.reshape(-1, 3))[0] - origin
    coordinates = local @ axes.T
    corners = (thing.vertices[thing.faces[facet]] - origin) @ axes.T
    flat, inside = coordinates[:, [0, 2]], np.ones(len(local), dtype=bool)
    area = -_cross(corners[1, [0, 2]] - corners[0, [0, 2]], corners[2, [0, 2]] - corners[0, [0, 2]])
    for k in range(3):
        start, end = corners[k, [0, 2]], corners[(k + 1) % 3, [0, 2]]
        inside &= -_cross(end - start, flat - start) >= -1e-12 * abs(area)
    return FacetDistances(coordinates.reshape(stage.shape), inside.reshape(stage.shape[:-1]))


class ObjectSet:
    """Search structures of some objects on a device; built once, used by distances and searches.

    Args:
        objects: Their numbers are their places in this sequence.
        device: Warp device.

    Attributes:
        objects: As given.
    """

    def __init__(self, objects: Sequence[GraspObject] | GraspObject, *, device: str = "cpu") -> None:
        import warp as wp
        from warpjld_kernels.surface_distance import Solids
        from warpjld_kernels.triangle_tree import Tree

        self.objects = (objects,) if isinstance(objects, GraspObject) else tuple(objects)
        if not self.objects:
            raise InputError("objects: want at least one")
        self.device = checked_device(device)
        self._meshes = [
            wp.Mesh(
                wp.array(thing.vertices.astype(np.float32), dtype=wp.vec3, device=self.device),
                wp.array(np.ascontiguousarray(thing.faces, np.int32).ravel(), dtype=wp.int32, device=self.device),
                support_winding_number=not thing.report.solid,
            )
            for thing in self.objects
        ]
        firsts = np.cumsum([0, *(len(thing.faces) for thing in self.objects)])[:-1]
        solids = Solids()
        solids.mesh = wp.array([mesh.id for mesh in self._meshes], dtype=wp.uint64, device=self.device)
        solids.first_face = wp.array(firsts.astype(np.int32), dtype=wp.int32, device=self.device)
        flags = np.array([thing.report.solid for thing in self.objects], dtype=np.int32)
        solids.solid = wp.array(flags, dtype=wp.int32, device=self.device)
        features = np.concatenate([_features(thing) for thing in self.objects])
        solids.features = wp.array(features.astype(np.float32), dtype=wp.vec3, device=self.device)
        tree, built = Tree(), join_trees([build_tree(thing.vertices, thing.faces) for thing in self.objects])
        for name, kind in (
            ("root", wp.int32),
            ("child", wp.int32),
            ("boxes", float),
            ("corners", float),
            ("face", wp.int32),
        ):
            setattr(tree, name, wp.array(getattr(built, name).ravel(), dtype=kind, device=self.device))
        solids.tree = tree
        self.solids: Any = solids
        """``warpjld_kernels.surface_distance.Solids`` on the device."""

    def __len__(self) -> int:
        return len(self.objects)

    def check(self, which: ArrayLike) -> NDArray[np.int32]:
        """Object numbers as an array; InputError where one does not exist."""
        numbers = np.atleast_1d(np.asarray(which, dtype=np.int32))
        if numbers.size and (numbers.min() < 0 or numbers.max() >= len(self)):
            raise InputError(f"objects: numbers go from 0 to {len(self) - 1}")
        return numbers

    def distances(
        self,
        points: ArrayLike,
        *,
        which: ArrayLike = 0,
        places: Places | None = None,
        sets: ArrayLike | None = None,
        limit: float = np.inf,
        nearest: bool = False,
        threads: int | None = None,
    ) -> Distances:
        """Signed distances of sets of points to objects at places, R rows in one launch.

        A row takes one set of points, one object and one place; each of the three is given once or R times.

        Args:
            points: On the stage [m], shape (n, 3) or (S, n, 3).
            which: Object of every row.
            places: Place of every row; the objects' own if left out.
            sets: Set of points of every row; by default row k takes set k, or all rows the only one.
            limit: Distances beyond it are not computed [m].
            nearest: Also give the nearest points.
            threads: CPU threads; by default all cores where there is enough to do.

        Raises:
            InputError: Wrong shapes, no such object or set, or points that are not finite.
        """
        import warp as wp
        from warpjld_kernels.surface_distance import measure

        cloud = np.ascontiguousarray(_finite_points(points), dtype=np.float32)
        cloud = cloud[None] if cloud.ndim == 2 else cloud
        if not limit > 0.0:
            raise InputError(f"limit: want metres above 0, got {limit:g}")
        rows = self._rows(len(cloud), which, places, sets)
        count, size = len(rows[0]), cloud.shape[1]
        distance = np.empty((count, size), dtype=np.float32)
        face = np.empty((count, size), dtype=np.int32)
        point = np.zeros((count, size, 3) if nearest else (0, 0, 3), dtype=np.float32)
        if not distance.size:
            return Distances(distance, face, point if nearest else None)
        kinds = (wp.int32, wp.vec3d, wp.quatd, wp.int32)
        inputs = [wp.array(a, dtype=k, device=self.device) for a, k in zip(rows, kinds, strict=True)]
        inputs.append(wp.array(cloud, dtype=wp.vec3, device=self.device, copy=False))
        outs = [
            wp.array(a, dtype=k, device=self.device, copy=False)
            for a, k in ((distance, float), (face, wp.int32), (point, wp.vec3))
        ]
        reach = float(min(limit, 1e9))

        def span(begin: int, end: int) -> None:
            wp.launch(
                measure,
                dim=(count, end - begin),
                inputs=[self.solids, *inputs, reach, begin],
                outputs=outs,
                device=self.device,
            )

        if threads is None:
            threads = min(os.cpu_count() or 1, max(1, distance.size // _SPLIT_BELOW))
        in_threads(span, size, threads if self.device.is_cpu else 1, measure, self.device)
        if not self.device.is_cpu:
            distance, face, point = (out.numpy() for out in outs)
        distance[face < 0] = np.inf
        return Distances(distance, face, point if nearest else None)

    def _rows(
        self, count: int, which: ArrayLike, places: Places | None, sets: ArrayLike | None
    ) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
        numbers = self.check(which)
        chosen = np.arange(count) if sets is None else np.atleast_1d(np.asarray(sets, dtype=np.int32))
        if chosen.size and (chosen.min() < 0 or chosen.max() >= count):
            raise InputError(f"sets: numbers go from 0 to {count - 1}")
        if places is None:
            own = [self.objects[k].place for k in numbers]
            places = Places(np.concatenate([p.position for p in own]), np.concatenate([p.rotation for p in own]))
        lengths = {len(numbers), len(places), len(chosen)}
        rows = max(lengths)
        if lengths - {1, rows}:
            raise InputError(
                f"rows: want as many objects as places and sets of points, or one of them, got {len(numbers)}, "
                f"{len(places)} and {len(chosen)}"
            )
        return (
            np.broadcast_to(numbers, rows).astype(np.int32),
            np.broadcast_to(places.position, (rows, 3)).copy(),
            np.broadcast_to(places.rotation, (rows, 4)).copy(),
            np.broadcast_to(chosen, rows).astype(np.int32),
        )


def in_threads(span: Any, count: int, threads: int, kernel: Any, device: Any) -> None:
    """``span(begin, end)`` over 0 … count cut into pieces, in threads of their own (launches release the GIL)."""
    import warp as wp

    cuts = np.unique(np.linspace(0, count, max(1, min(threads, count)) + 1).astype(int)).tolist()
    if len(cuts) <= 2:
        span(0, count)
        return
    wp.load_module(kernel.module, device=device)  # compiling is not safe from several threads
    others = [_pool(threads).submit(span, begin, end) for begin, end in pairwise(cuts[1:])]
    span(cuts[0], cuts[1])
    for other in others:
        other.result()


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Kept for the next call."""
    return ThreadPoolExecutor(threads - 1, thread_name_prefix="warpjld-grasp")


def feature_normals(vertices: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.float64]:
    """Normals of a triangle, of its edges opposite to corner 0, 1, 2, and of its corners, shape (t, 7, 3).

    An edge has the sum of the normals at it, a corner their sum weighted by angle (Bærentzen and Aanæs 2005).
    Triangles without area have none and add none.
    """
    corner = vertices[faces]
    normal = _face_normals(corner)
    out = np.empty((len(faces), 7, 3))
    out[:, 0] = normal
    edges = np.sort(faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    _, place = np.unique(edges, axis=0, return_inverse=True)
    total = np.zeros((int(place.max()) + 1, 3))
    np.add.at(total, place.ravel(), np.repeat(normal, 3, axis=0))
    out[:, 1:4] = total[place.reshape(-1, 3)]
    at_corner = np.zeros((len(vertices), 3))
    for k in range(3):
        to_next, to_last = corner[:, (k + 1) % 3] - corner[:, k], corner[:, (k + 2) % 3] - corner[:, k]
        sine = np.linalg.norm(np.cross(to_next, to_last), axis=1)
        angle = np.arctan2(sine, (to_next * to_last).sum(axis=1))
        np.add.at(at_corner, faces[:, k], angle[:, None] * normal)
    out[:, 4:] = at_corner[faces]
    return out


def _features(thing: GraspObject) -> NDArray[np.float64]:
    """Feature normals; only the faces' own where winding numbers tell inside from outside."""
    if thing.report.solid:
        return feature_normals(thing.vertices, thing.faces)
    out = np.zeros((len(thing.faces), 7, 3))
    out[:, 0] = _face_normals(thing.vertices[thing.faces])
    return out


def _face_normals(corner: NDArray[np.float64]) -> NDArray[np.float64]:
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300))


def _finite_points(points: ArrayLike) -> NDArray[np.float64]:
    array = np.asarray(points)
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise InputError(f"points: want shape (n, 3) or (sets, n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"points: entry {np.argwhere(~np.isfinite(array))[0].tolist()} is not finite")
    return array


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
