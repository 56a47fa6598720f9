"""Signed distances and closest points from points to objects (C19)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering.device import checked_device
from warpjld.errors import InputError
from warpjld.geometry.spatial_order import spatial_order
from warpjld.grasp.feature_normals import face_normals, feature_normals
from warpjld.grasp.objects import GraspObject, Places
from warpjld.grasp.triangle_frames import triangle_frames
from warpjld.grasp.triangle_tree import build_tree, join_trees
from warpjld.runtime.query_mesh import query_mesh
from warpjld.runtime.threads import in_threads, threads_for

__all__ = ["Distances", "ObjectSet", "finite_points"]

_SPLIT_BELOW = 2_000  # points per thread below which work is not split further


@dataclass(frozen=True, eq=False)
class Distances:
    """Signed distances and closest points of R rows of n points.

    Attributes:
        distance: Signed distance [m], negative inside, shape (R, n); +inf where nothing lies within the limit.
        face: Nearest triangle, -1 where there is none, shape (R, n).
        point: Nearest points on the stage [m], shape (R, n, 3), or None where they were not asked for.
    """

    distance: NDArray[np.float32]
    face: NDArray[np.int32]
    point: NDArray[np.float32] | None


_SORT_ABOVE = 15_000  # distances above which sorting the points costs less than it saves on the CPU
_RUN = 32  # points that one thread of the CPU measures one after another


class ObjectSet:
    """Search structures of objects on a device; built once, used by distances and searches.

    Args:
        objects: One or more; an object's number is its index here.
        device: Warp device.

    Attributes:
        objects: As given.
    """

    def __init__(self, objects: Sequence[GraspObject] | GraspObject, *, device: str = "cpu") -> None:
        import warp as wp
        from warpjld_kernels.surface_distance import Solids

        self.objects = (objects,) if isinstance(objects, GraspObject) else tuple(objects)
        if not self.objects:
            raise InputError("objects: want at least one")
        self.device = checked_device(device)
        self._meshes = [
            query_mesh(thing.vertices, thing.faces, winding=not thing.report.solid, device=self.device)
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
        solids.tree = _tree_on(self.device, self.objects)
        self.solids: Any = solids
        """``warpjld_kernels.surface_distance.Solids`` on the device."""

    def __len__(self) -> int:
        return len(self.objects)

    def check(self, which: ArrayLike) -> NDArray[np.int32]:
        """Object numbers as an array.

        Raises:
            InputError: A number that does not exist.
        """
        numbers = np.atleast_1d(np.asarray(which, dtype=np.int32))
        if numbers.size and (numbers.min() < 0 or numbers.max() >= len(self)):
            raise InputError(f"objects: numbers go from 0 to {len(self) - 1}")
        return numbers

    def places(self, which: ArrayLike) -> Places:
        """The objects' own placements, one for each number."""
        own = [self.objects[k].place for k in self.check(which)]
        return Places(np.concatenate([p.position for p in own]), np.concatenate([p.rotation for p in own]))

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
        """Signed distances of sets of points to placed objects, R rows in one launch.

        A row combines one set of points, one object and one placement; each of the three is given once or R times.

        Args:
            points: World positions [m], shape (n, 3) or (S, n, 3).
            which: Object number of every row.
            places: Placement of every row; the objects' own if left out.
            sets: Set of points of every row; by default row k takes set k, or all rows the only one.
            limit: Distances beyond it are not computed [m].
            nearest: Also give the nearest points.
            threads: CPU threads; by default all cores where there is enough to do.

        Raises:
            InputError: Wrong shapes, no such object or set, or points that are not finite.
        """
        import warp as wp
        from warpjld_kernels.surface_distance import measure

        cloud = np.ascontiguousarray(finite_points(points), dtype=np.float32)
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
        reach, run = float(min(limit, 1e9)), _RUN if self.device.is_cpu else 1
        sort = self.device.is_cpu and distance.size > _SORT_ABOVE
        order = wp.array(
            spatial_order(cloud[0]).astype(np.int32) if sort else np.empty(0, np.int32),
            dtype=wp.int32,
            device=self.device,
        )

        def span(begin: int, end: int) -> None:
            wp.launch(
                measure,
                dim=(count, -(-(end - begin) // run)),
                inputs=[self.solids, *inputs, reach, order, begin, end, run],
                outputs=outs,
                device=self.device,
            )

        if threads is None:
            threads = threads_for(distance.size, _SPLIT_BELOW)
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
            places = self.places(numbers)
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


def _tree_on(device: Any, things: Sequence[GraspObject]) -> Any:
    """``warpjld_kernels.triangle_tree.Tree`` of all objects on a device."""
    import warp as wp
    from warpjld_kernels.triangle_tree import Tree

    tree, built = Tree(), join_trees([build_tree(thing.vertices, thing.faces) for thing in things])
    frames = triangle_frames(built.corners.transpose(0, 3, 1, 2)).transpose(0, 2, 1)
    kinds = {"root": wp.int32, "child": wp.int32, "boxes": float, "corners": float, "face": wp.int32}
    for name, kind in kinds.items():
        setattr(tree, name, wp.array(getattr(built, name).ravel(), dtype=kind, device=device))
    tree.frames = wp.array(frames.ravel(), dtype=float, device=device)
    return tree


def _features(thing: GraspObject) -> NDArray[np.float64]:
    """Pseudonormals (t, 7, 3); only the faces' own where winding numbers decide between inside and outside."""
    if thing.report.solid:
        return feature_normals(thing.vertices, thing.faces)
    out = np.zeros((len(thing.faces), 7, 3))
    out[:, 0] = face_normals(thing.vertices[thing.faces])
    return out


def finite_points(points: ArrayLike) -> NDArray[np.float64]:
    """Points (n, 3) or sets of points (S, n, 3) as an array.

    Raises:
        InputError: Wrong shape, or a number that is not finite.
    """
    array = np.asarray(points)
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise InputError(f"points: want shape (n, 3) or (sets, n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"points: entry {np.argwhere(~np.isfinite(array))[0].tolist()} is not finite")
    return array
