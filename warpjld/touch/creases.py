"""Bisecting planes of joints, at which the two sides of a bent joint are separated."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from warpjld.geometry.rotations import rotate, unit
from warpjld.geometry.segment_distance import segment_distance
from warpjld.skeleton.kinematics import Poses
from warpjld.touch.frame import FULL, NONE, SHARE
from warpjld.touch.host_arrays import recorded
from warpjld.touch.patches import Patches
from warpjld.touch.smoothing import edge_lengths, skin_smoothing

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["CreaseBench", "Creases"]

_KEPT = 0.25
"""Share of its rest distance from the plane that a vertex is kept away from it at most. At 0 the skin of both sides
would lie in one plane and cross by rounding; larger values move skin that does not cross."""

_LEAST_APART = 0.03  # smallest distance of a vertex from the plane, in thicknesses, where `_KEPT` allows it
_WIDER = 4.0  # additional separation relative to the smoothed overlap
_WIDEST = 1.0  # upper bound of the additional separation, in thicknesses
_STEPS = 3  # pushing and smoothing steps: one leaves a fifth more crossings, a fourth changes little
_REACH = 6.0  # range from the joint, in thicknesses; weights fade over the last one
_BENT = (np.radians(5.0), np.radians(20.0))  # rotation from rest over which separation sets in
_WIDE = (0.9, 1.4)  # range along the flexion axis, in thicknesses, over which weights fade: beyond is other skin
_LEAST = 0.02  # smallest weight of a vertex that is used


@dataclass(frozen=True, eq=False)
class Creases:
    """The bisecting planes of joints, and the vertices near them.

    The plane of a joint between segments along a and b passes through the joint, normal to a + b at rest, and turns by
    the rotation halfway between its bones. The papers' inner surfaces meet on it (A §4). An entry is a vertex near one
    plane.

    Attributes:
        joint: Joint of every plane, shape (C,).
        parent: Joint where its first segment begins, likewise.
        normal: Unit normal at rest, towards the second segment, shape (C, 3).
        vertex: Vertices near any plane, shape (N,).
        first: First entry of each of them, and the number of entries, shape (N + 1,).
        crease: Plane of every entry.
        height: Signed rest distance from the plane [m], positive on the side of the second segment.
        weight: Weight of the entry, 0…1.
        opposite: Three vertices of the other side near the vertex's mirror image at rest, shape (entries, 3).
        share: Their weights, rows summing to one, likewise.
        size: Thickness of the flesh at every plane [m], shape (C,).
        smooth: Smoothing matrix for fields on the surface, shape (V, V).
    """

    joint: NDArray[np.int32]
    parent: NDArray[np.int32]
    normal: NDArray[np.float64]
    vertex: NDArray[np.int32]
    first: NDArray[np.int32]
    crease: NDArray[np.int32]
    height: NDArray[np.float32]
    weight: NDArray[np.float32]
    opposite: NDArray[np.int32]
    share: NDArray[np.float32]
    size: NDArray[np.float64]
    smooth: csr_array

    @classmethod
    def of(cls, covering: Covering, patches: Patches) -> Creases:
        """Planes of all joints between segments of different operators."""
        skeleton, vertices = covering.skeleton, covering.surface.vertices
        thick = segment_distance(vertices, skeleton.rest, [(s.proximal, s.distal) for s in skeleton.segments])
        shell = patches.shell
        fine = ~patches.coarse(edge_lengths(vertices, patches.faces))[patches.part]
        fan_of = {(s.proximal, s.distal): f for f, fan in enumerate(covering.fans) for s in fan.segments}
        planes: list[tuple[int, int, NDArray[np.float64], float]] = []
        entries: list[_Entries] = []
        for (a, joint), near_fan in fan_of.items():
            for (start, b), far_fan in fan_of.items():
                if start != joint or near_fan == far_fan:
                    continue
                rest = skeleton.rest
                normal = unit(unit(rest[joint] - rest[a]) + unit(rest[b] - rest[joint]))
                offset = vertices - rest[joint]
                distance = np.linalg.norm(offset, axis=1)
                far = covering.domains[:, far_fan]
                size = _size(thick, distance, far)
                if not size > 0.0:
                    continue
                weight = np.clip(_REACH - distance / size, 0.0, 1.0)
                weight *= np.clip(covering.domains[:, near_fan] + far, 0.0, 1.0)
                along = np.abs(offset @ skeleton.axes[joint]) / size
                weight *= np.clip((_WIDE[1] - along) / (_WIDE[1] - _WIDE[0]), 0.0, 1.0)
                rows = np.flatnonzero((weight > _LEAST) & fine)
                found = _Entries.of(rows, offset[rows], normal, weight[rows], size, shell[rows])
                if found is not None:
                    planes.append((joint, a, normal, size))
                    entries.append(found)
        return cls._sorted(planes, entries, skin_smoothing(vertices, patches))

    @classmethod
    def _sorted(
        cls, planes: list[tuple[int, int, NDArray[np.float64], float]], entries: list[_Entries], smooth: csr_array
    ) -> Creases:
        """The planes (joint, parent, normal, size) and their entries, sorted by vertex."""
        joined = _Entries.joined(entries)
        crease = np.repeat(np.arange(len(entries)), [len(e.rows) for e in entries])
        order = np.argsort(joined.rows, kind="stable")
        vertex, first = np.unique(joined.rows[order], return_index=True)
        return cls(
            np.array([p[0] for p in planes], dtype=np.int32),
            np.array([p[1] for p in planes], dtype=np.int32),
            np.array([p[2] for p in planes]).reshape(-1, 3),
            vertex.astype(np.int32),
            np.append(first, len(joined.rows)).astype(np.int32),
            crease[order].astype(np.int32),
            joined.height[order].astype(np.float32),
            joined.weight[order].astype(np.float32),
            joined.opposite[order].astype(np.int32),
            joined.share[order].astype(np.float32),
            np.array([p[3] for p in planes]),
            smooth,
        )

    def planes(self, poses: Poses) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Unit normals of the planes in F poses, shape (F, C, 3), and how far their joints are bent, shape (F, C): 0
        where nothing has to be separated."""
        first, second = poses.rotations[:, self.parent], poses.rotations[:, self.joint]
        same = np.where((first * second).sum(axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
        normal = rotate(unit(first + same * second), self.normal)
        angle = 2.0 * np.arccos(np.clip(np.abs((first * second).sum(axis=-1)), 0.0, 1.0))
        bent = np.clip((angle - _BENT[0]) / (_BENT[1] - _BENT[0]), 0.0, 1.0)
        return normal.astype(np.float32), bent.astype(np.float32)

    def bench(self, points: Any) -> CreaseBench:
        """Separation of the two sides of bent joints, in place in a Warp array of vertices (V,) on the CPU."""
        return CreaseBench(self, points)

    @cached_property
    def arrays(self) -> tuple[Any, list[Any], list[Any]]:
        """Kernel arguments: the creases, and the smoothing matrix by rows and by columns."""
        import warp as wp
        from warpjld_kernels.touch_crease import Creases as Arrays

        def array(values: NDArray, kind: Any) -> Any:
            flat = np.float32 if values.dtype.kind == "f" else np.int32
            return wp.array(np.ascontiguousarray(values, dtype=flat), dtype=kind, device="cpu")

        out = Arrays()
        for name, kind in Arrays.vars.items():
            setattr(out, name, array(getattr(self, name), kind.type.dtype))
        rows, columns = (
            [array(matrix.indptr, wp.int32), array(matrix.indices, wp.int32), array(matrix.data, float)]
            for matrix in (self.smooth, csr_array(self.smooth.T))
        )
        return out, rows, columns


class CreaseBench:
    """Workspace of one thread for the two sides of bent joints, with launches recorded once.

    Args:
        creases: The planes.
        points: Warp array of a frame's vertices on the CPU, vec3, shape (V,), which is changed in place.
    """

    def __init__(self, creases: Creases, points: Any) -> None:
        import warp as wp
        from warpjld_kernels.touch_crease import measure_creases, move_smoothly, push_creases, smooth_overlaps

        arrays, rows, columns = creases.arrays
        planes, count, size = len(creases.joint), len(points), len(creases.vertex)
        normal = wp.zeros(planes, dtype=wp.vec3, device="cpu")
        bent, deepest = (wp.zeros(planes, dtype=float, device="cpu") for _ in range(2))
        number, near = (wp.zeros(n, dtype=wp.int32, device="cpu") for n in (1, size))
        overlap, smoothed = (wp.zeros(n, dtype=float, device="cpu") for n in (count, size))
        total, shift = (wp.zeros(n, dtype=wp.vec3, device="cpu") for n in (count, size))
        self._normal, self._bent, self._deepest = normal.numpy(), bent.numpy(), deepest.numpy()
        self._number = number.numpy()
        frame, listed = [arrays, normal, bent, points], [number, near]
        self._measure = recorded(measure_creases, min(size, 1), [*frame, SHARE, _KEPT], [*listed, overlap, deepest])
        self._smooth = recorded(smooth_overlaps, 1, [arrays, *listed, overlap, *rows], [smoothed])
        amounts = [_KEPT, _LEAST_APART, _WIDER, _WIDEST, FULL, NONE]
        self._step = (
            recorded(push_creases, 1, [*frame, *listed, deepest, smoothed, *amounts], [shift]),
            recorded(move_smoothly, 1, [arrays, *listed, shift, *columns, total], [points]),
        )

    def part(self, normal: NDArray[np.float32], bent: NDArray[np.float32]) -> None:
        """Separate the two sides at planes (C, 3) of joints that are bent (C,), as :meth:`Creases.planes` has them."""
        if not bent.any():
            return
        self._normal[...] = normal
        self._bent[...] = bent
        self._deepest[...] = 0.0
        self._number[...] = 0
        self._measure.launch()
        if self._number[0]:
            self._smooth.launch()
            for _ in range(_STEPS):
                for command in self._step:
                    command.launch()


@dataclass(frozen=True, eq=False)
class _Entries:
    """Vertices near one plane; fields as in :class:`Creases`."""

    rows: NDArray[np.int64]
    height: NDArray[np.float64]
    weight: NDArray[np.float64]
    opposite: NDArray[np.int64]
    share: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        rows: NDArray[np.int64],
        offset: NDArray[np.float64],
        normal: NDArray[np.float64],
        weight: NDArray[np.float64],
        size: float,
        shell: NDArray[np.int32],
    ) -> _Entries | None:
        """Entries of vertices near one plane; None where one side has fewer than three vertices.

        Args:
            rows: Vertices, shape (N,).
            offset: Their offsets from the joint at rest [m], shape (N, 3).
            normal: Normal of the plane, shape (3,).
            weight: Weight of each vertex, shape (N,).
            size: Thickness of the flesh [m].
            shell: Connected component of each, shape (N,). Opposite vertices are of the same one, since separate pieces
                that overlap at a joint are meant to.
        """
        height = offset @ normal
        sides = [np.flatnonzero(height < 0.0), np.flatnonzero(height > 0.0)]
        if min(map(len, sides)) < 3:
            return None
        mirrored = offset - 2.0 * height[:, None] * normal
        offset, mirrored = (np.column_stack([a, 1e3 * size * shell]) for a in (offset, mirrored))
        opposite = np.zeros((len(rows), 3), dtype=np.int64)
        share = np.zeros((len(rows), 3))
        gate = np.zeros(len(rows))
        for near_side, far_side in (sides, sides[::-1]):
            distance, near = cKDTree(offset[far_side]).query(mirrored[near_side], k=3)
            inverse = 1.0 / (distance + 1e-3 * size)
            opposite[near_side], share[near_side] = rows[far_side[near]], inverse / inverse.sum(axis=1, keepdims=True)
            gate[near_side] = np.clip(2.0 - 2.0 * distance[:, 0] / size, 0.0, 1.0)
        kept = np.flatnonzero(weight * gate > _LEAST)
        return cls(rows[kept], height[kept], (weight * gate)[kept], opposite[kept], share[kept])

    @staticmethod
    def joined(entries: list[_Entries]) -> _Entries:
        """Concatenation of entries."""
        none = _Entries(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros((0, 3), np.int64), np.zeros((0, 3)))
        names = [field.name for field in fields(_Entries)]
        return _Entries(*(np.concatenate([getattr(e, name) for e in (none, *entries)]) for name in names))


def _size(thick: NDArray[np.float64], distance: NDArray[np.float64], share: NDArray[np.float64]) -> float:
    """Median thickness of the second segment's flesh in the half next to the joint [m]; 0 where it has none.

    Args:
        thick: Distance of every vertex from its bone [m], shape (V,).
        distance: Distance of every vertex from the joint [m], shape (V,).
        share: Weight of the second segment's operator at every vertex, shape (V,).
    """
    held = share > 0.5
    if not held.any():
        return 0.0
    return float(np.median(thick[held & (distance <= np.median(distance[held]))]))
