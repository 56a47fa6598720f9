"""Signed distances near one object: exact within a limit, elsewhere only bounds from a grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.device import shared_on
from warpjld.grasp.distance import ObjectSet
from warpjld.grasp.objects import GraspObject
from warpjld.grasp.outline_points import outline_points
from warpjld.grasp.point_groups import grouped_points

__all__ = ["NearObject", "NearPoints"]

_STEP = 4e-3  # spacing of the grid [m]
_AROUND = 2  # margin of the grid around the object's bounding box, in steps
_MOST = 400_000  # largest number of grid nodes; a larger object has a coarser grid


@dataclass(frozen=True, eq=False)
class NearPoints:
    """Closest points on an object, for points inside it or within a limit of it.

    Attributes:
        distance: Signed distance [m], +inf where it is surely beyond the limit, shape (n,).
        face: Nearest triangle, -1 where the distance is infinite, shape (n,).
        point: Nearest points in the object's frame [m], shape (n, 3); valid only where ``face`` is not -1.
    """

    distance: NDArray[np.float32]
    face: NDArray[np.int32]
    point: NDArray[np.float32]


class NearObject:
    """An object in its own frame, with a grid of signed distances that is filled lazily, node by node.

    Args:
        thing: The object at its own placement.
        device: Warp device of the object, its grid, and all that is measured or searched on it.

    Attributes:
        thing: As given.
        objects: The object alone, placed at the origin.
        device: The Warp device.
    """

    def __init__(self, thing: GraspObject, device: str = "cpu") -> None:
        import warp as wp
        from warpjld_kernels.signed_grid import UNKNOWN, SignedGrid

        self.thing, self.objects = thing, ObjectSet(thing.placed(), device=device)
        self.device = self.objects.device
        low, high = self._box = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
        size = high - low
        step = max(_STEP, float((np.prod(size + 4.0 * _STEP) / _MOST) ** (1.0 / 3.0)))
        count = np.ceil(size / step).astype(int) + 2 * _AROUND + 1 if thing.report.solid else np.zeros(3, dtype=int)
        grid = SignedGrid()
        # upper bound of the error from rounding the surface to float32
        slack = 1e-6 * float(np.abs(thing.vertices).max())
        grid.object, grid.step = 0, step
        grid.lowest, grid.highest = wp.vec3d(*(low - slack)), wp.vec3d(*(high + slack))
        grid.low, grid.count = wp.vec3d(*(low - _AROUND * step)), wp.vec3i(*count.tolist())
        grid.values = wp.full(int(count.prod()), float(UNKNOWN), dtype=wp.float64, device=self.device)
        self.grid: Any = grid

    @cached_property
    def outline(self) -> Any:
        """Its vertices and points of its sharp edges (``outline_points``) for ``PosedSkins.least_distances``."""
        return grouped_points(outline_points(self.thing))

    def least_by_part(
        self, points: Any, chosen: NDArray[np.int32], part_of: NDArray[np.int32], gaps: NDArray[np.float64]
    ) -> None:
        """Lower ``gaps`` (P, parts), in place, to the smallest signed distance of each part's points to the object [m].

        Args:
            points: ``wp.array`` of vec3, P or more poses in the object's frame.
            chosen: Indices of the points to measure, shape (n,).
            part_of: Part of each of them, shape (n,).
            gaps: Distances found so far, contiguous; only smaller ones are looked for.
        """
        import warp as wp
        from warpjld_kernels.signed_grid import least_by_part

        scratch = np.empty((len(gaps), len(chosen), 2))
        nearest = np.full(gaps.shape, -1, dtype=np.int32)
        arrays = (
            (chosen, wp.int32),
            (part_of, wp.int32),
            (scratch, wp.vec2d),
            (nearest, wp.int32),
            (gaps, wp.float64),
        )
        held = [shared_on(self.device, a, kind) for a, kind in arrays]
        inputs = [self.objects.solids, self.grid, points.to(self.device), *held]
        wp.launch(least_by_part, len(gaps), inputs=inputs, device=self.device)
        if not self.device.is_cpu:
            gaps[...] = held[-1].numpy()

    def least(self, skins: NDArray[np.floating]) -> NDArray[np.float64]:
        """Smallest signed distance of skins (P, V, 3) in world space to the object at its own placement [m], (P,)."""
        import warp as wp

        count = skins.shape[1]
        local = self.thing.place.to_local(skins.reshape(-1, 3))[0].astype(np.float32)
        points = shared_on(self.device, local.reshape(skins.shape), wp.vec3)
        gaps = np.full((len(skins), 1), np.inf)
        self.least_by_part(points, np.arange(count, dtype=np.int32), np.zeros(count, dtype=np.int32), gaps)
        return gaps[:, 0]

    def met(self, points: NDArray[np.float64], direction: NDArray[np.float64], gap: float) -> NDArray[np.bool_]:
        """Mask of points that may come within a gap of the object as they move, shape (n,).

        The others pass the object's bounding box at a larger distance.

        Args:
            points: Points in world space [m], shape (n, 3); the object is at its own placement.
            direction: Direction in which they move, shape (3,).
            gap: The gap [m].
        """
        place = self.thing.place
        start = place.to_local(points)[0]
        along = place.to_local((place.position[0] + direction)[None])[0, 0]
        entered, left = np.zeros(len(points)), np.full(len(points), np.inf)
        for k, (low, high) in enumerate(zip(*self._box, strict=True)):
            with np.errstate(divide="ignore", invalid="ignore"):  # of points that move along a side of the box
                first, last = (low - gap - start[:, k]) / along[k], (high + gap - start[:, k]) / along[k]
            entered = np.fmax(entered, np.fmin(first, last))
            left = np.fmin(left, np.fmax(first, last))
        return np.asarray(entered <= left)

    def at_least(self, points: NDArray[np.floating], beside: tuple[Any, Any]) -> NDArray[np.float32]:
        """Lower bounds, from the grid, of signed distances of all points on the edges at vertices [m], shape (G, V).

        Args:
            points: Vertices of G poses of a skin in the object's frame [m], shape (G, V, 3).
            beside: Neighbours of every vertex, see ``FinerSkin.beside``.
        """
        import warp as wp
        from warpjld_kernels.signed_grid import least_distances

        asked = shared_on(self.device, np.ascontiguousarray(points, np.float32), wp.vec3)
        out = wp.empty(points.shape[:-1], dtype=float, device=self.device)
        inputs = [self.grid, self.objects.solids, asked, *(one.to(self.device) for one in beside)]
        wp.launch(least_distances, out.shape, inputs=inputs, outputs=[out], device=self.device)
        return np.asarray(out.numpy())

    def near(self, points: NDArray[np.floating], limit: float) -> NearPoints:
        """Closest points for points (n, 3) in the object's frame that lie inside it or within a limit [m] of it."""
        import warp as wp
        from warpjld_kernels.signed_grid import measure_near

        count = len(points)
        asked = shared_on(self.device, np.ascontiguousarray(points, np.float64), wp.vec3d)
        outs = [wp.zeros(count, dtype=kind, device=self.device) for kind in (float, wp.int32, wp.vec3)]
        inputs = [self.objects.solids, self.grid, asked, limit]
        wp.launch(measure_near, count, inputs=inputs, outputs=outs, device=self.device)
        distance, face, point = (out.numpy() for out in outs)
        distance[face < 0] = np.inf
        return NearPoints(distance, face, point)
