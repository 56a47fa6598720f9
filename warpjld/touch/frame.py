"""One frame's surface parted: what lies where, and both sides moved out of one another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from warpjld.touch.patches import Patches

__all__ = ["SHARE", "Bench", "Model", "Overlaps"]

SHARE = 1.0 / 3.0
"""Of the local thickness: overlaps up to it skin can give way to, deeper ones are poses that nobody can take."""

_FULL, _NONE = (
    1.5,
    2.5,
)  # shares: overlaps that deep at most are parted in full, those deeper than the second left alone
_SWEEPS = 3
_SOFT = 0.05  # shares over which an overlap comes to count
_CLEARANCE = 0.05  # shares by which both sides are moved beyond their meeting
_STIFFNESS = 0.1  # of the fit of planes: samples that weigh less than that in all move nothing in full
_BULGE = 0.5  # shares that a bulge is high at most


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Vertices of one frame that lie inside another part, N of them.

    Attributes:
        vertex: Their numbers.
        part: Their parts.
        other: What they are inside of.
        depth: How deep [m], beyond what overlaps at rest.
        ratio: The same in shares of what skin can give way to; above 1 nobody can take the pose.
    """

    vertex: NDArray[np.int32]
    part: NDArray[np.int32]
    other: NDArray[np.int32]
    depth: NDArray[np.float64]
    ratio: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """What parting needs of a surface in any frame.

    Attributes:
        patches: Its parts.
        smooth: Rows that smooth a field, shape (V, V).
        at_rest: Depth of every vertex that is no overlap since it is one at rest [m], shape (V,).
        never: Parts that may lie in one another, shape (P, P).
        edge: Mean length of the edges at every vertex [m], shape (V,).
    """

    patches: Patches
    smooth: csr_array
    at_rest: NDArray[np.float64]
    never: NDArray[np.bool_]
    edge: NDArray[np.float64]


class Bench:
    """Meshes of the parts and arrays of one frame: made once for a thread, refitted for every frame it takes."""

    def __init__(self, model: Model, vertices: NDArray[np.floating]) -> None:
        import warp as wp
        from warpjld_kernels.touch_samples import Parts, Samples

        wp.init()
        self.model = model
        patches = model.patches
        count, names = len(vertices), len(patches.names)
        self.points = self._vectors(vertices)
        meshes = [patches.mesh(k) for k in range(names)]
        self._meshes = [wp.Mesh(self.points, self._numbers(f.ravel())) if len(f) else None for f, _ in meshes]
        corners = [np.unique(f) for f, _ in meshes]
        joined = patches.joined
        empty = np.array([not len(f) for f, _ in meshes], dtype=bool)
        apart = np.where(joined, 2, np.where(empty[:, None] | empty | model.never, 0, 1))
        beside = np.full((names, int(joined.sum(axis=1).max())), -1)
        for k, row in enumerate(joined):
            some = np.flatnonzero(row)
            beside[k, : len(some)] = some
        self.parts = parts = Parts()
        parts.part = self._numbers(patches.part)
        parts.mesh = wp.array([m.id if m else 0 for m in self._meshes], dtype=wp.uint64, device="cpu")
        parts.first_corner = self._starts([len(c) for c in corners])
        parts.corner = self._numbers(np.concatenate(corners))
        parts.first_face = self._starts([len(f) for f, _ in meshes])
        parts.border = self._floats(np.concatenate([b.ravel() for _, b in meshes]))
        parts.apart = self._numbers(apart)
        parts.beside = self._numbers(beside)
        parts.thickness = self._floats(patches.thickness)
        parts.give = self._floats(patches.give)
        mean = np.bincount(patches.part, patches.give, names) / np.maximum(
            np.bincount(patches.part, minlength=names), 1
        )
        parts.give_of = self._floats(mean)
        parts.at_rest = self._floats(model.at_rest)
        a, b, c = (np.asarray(vertices, dtype=np.float64)[patches.faces[:, k]] for k in range(3))
        around = [np.bincount(patches.faces.ravel(), np.repeat(n, 3), count) for n in np.cross(b - a, c - a).T]
        parts.area = self._floats(np.linalg.norm(around, axis=0) / 6.0)
        parts.edge = self._floats(model.edge)
        corner = patches.faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
        order = np.argsort(patches.faces.ravel(), kind="stable")
        self._around = wp.array(corner[order].astype(np.int32), dtype=wp.vec2i, device="cpu")
        self._first = self._starts(np.bincount(patches.faces.ravel(), minlength=count).tolist())
        self._rows = [
            self._numbers(model.smooth.indptr),
            self._numbers(model.smooth.indices),
            self._floats(model.smooth.data),
        ]
        self.samples = samples = Samples()
        room = 2 * count
        samples.count = self._numbers(np.zeros(1))
        for name, kind in Samples.vars.items():
            if name != "count":
                setattr(samples, name, wp.zeros(room, dtype=kind.type.dtype, device="cpu"))
        self._low, self._high = (wp.zeros(names, dtype=wp.vec3, device="cpu") for _ in range(2))
        self._reach = [wp.zeros(names, dtype=wp.vec3, device="cpu") for _ in range(2)]
        self._count, self._wanted, self._active = (wp.zeros(names, dtype=wp.int32, device="cpu") for _ in range(3))
        self._others = wp.zeros((names, names), dtype=wp.int32, device="cpu")
        self._deepest = wp.zeros((names, names), dtype=float, device="cpu")
        self._shown = wp.zeros(room, dtype=float, device="cpu")
        self._normals, self._moved, self._before = (wp.zeros(count, dtype=wp.vec3, device="cpu") for _ in range(3))
        self._ring = wp.zeros(count, dtype=float, device="cpu")
        self._lost, self._room = (wp.zeros(names, dtype=float, device="cpu") for _ in range(2))

    @staticmethod
    def _vectors(values: NDArray[np.floating]) -> Any:
        import warp as wp

        return wp.array(np.array(values, dtype=np.float32), dtype=wp.vec3, device="cpu")

    @staticmethod
    def _numbers(values: NDArray) -> Any:
        import warp as wp

        return wp.array(np.ascontiguousarray(values, dtype=np.int32), dtype=wp.int32, device="cpu")

    @staticmethod
    def _floats(values: NDArray) -> Any:
        import warp as wp

        return wp.array(np.ascontiguousarray(values, dtype=np.float32), dtype=float, device="cpu")

    def _starts(self, lengths: list[int]) -> Any:
        return self._numbers(np.concatenate([[0], np.cumsum(lengths)]))

    def find(self) -> int:
        """Fill ``samples`` from ``points``; how many there are."""
        import warp as wp
        from warpjld_kernels import touch_samples as kernels

        def launch(kernel: Any, dim: int, inputs: list[Any], outputs: list[Any]) -> None:
            wp.launch(kernel, dim, inputs=inputs, outputs=outputs, device="cpu")

        names, count = len(self._meshes), len(self.points)
        launch(kernels.find_boxes, names, [self.points, self.parts], [self._low, self._high])
        for array in (self._wanted, self._active, self.samples.count):
            array.zero_()
        launch(
            kernels.find_pairs,
            names,
            [self.parts, self._low, self._high],
            [self._count, self._others, self._wanted, self._active],
        )
        wanted = np.flatnonzero(self._wanted.numpy())
        if not len(wanted):
            return 0
        for k in wanted.tolist():
            if (mesh := self._meshes[k]) is not None:
                mesh.refit()
        launch(
            kernels.find_normals,
            count,
            [self.points, self.parts.part, self._active, self._first, self._around],
            [self._normals],
        )
        self._deepest.zero_()
        launch(
            kernels.find_samples,
            count,
            [
                *(self.points, self._normals, self._low, self._high, self._count, self._others),
                *(self.parts, SHARE, _SOFT),
            ],
            [self._deepest, self.samples],
        )
        return min(int(self.samples.count.numpy()[0]), len(self._shown))

    def overlaps(self, count: int) -> Overlaps:
        """The first ``count`` samples."""
        s = self.samples
        vertex, own, other, depth, ratio = (
            a.numpy()[:count].copy() for a in (s.vertex, s.own, s.other, s.depth, s.ratio)
        )
        return Overlaps(vertex, own, other, depth.astype(np.float64), ratio.astype(np.float64))

    def measure(self, points: NDArray[np.floating]) -> Overlaps:
        """What overlaps in one frame (V, 3)."""
        self.points.numpy()[...] = points
        return self.overlaps(self.find())

    def part(self, points: NDArray[np.floating]) -> Overlaps:
        """Part one frame (V, 3) in place; what overlapped before."""
        there = self.points.numpy()
        there[...] = points
        count = self.find()
        found = self.overlaps(count)
        if not count:
            return found
        self._before.numpy()[...] = there
        before = there.copy()
        for sweep in range(_SWEEPS):
            if sweep:
                count = self.find()
            if not count:
                break
            self._move(count)
            if sweep == 0:
                self._bulge()
        at = (there != before).any(axis=1)
        points[at] = there[at]
        return found

    def _move(self, count: int) -> None:
        import warp as wp
        from warpjld_kernels import touch_parting as kernels

        names, low_high = len(self._meshes), self._reach
        wp.launch(kernels.no_boxes, names, outputs=low_high, device="cpu")
        wp.launch(
            kernels.fade_samples,
            count,
            inputs=[self.samples, self.parts, self._deepest, _FULL, _NONE],
            outputs=[self._shown, *low_high],
            device="cpu",
        )
        state = [self.points, self._normals, self.samples, count, self._shown, *low_high]
        wp.launch(
            kernels.part_surfaces,
            len(self.points),
            inputs=[*state, self.parts, _CLEARANCE, _STIFFNESS],
            outputs=[self._moved],
            device="cpu",
        )
        wp.launch(kernels.move, len(self.points), inputs=[self._moved], outputs=[self.points], device="cpu")

    def _bulge(self) -> None:
        import warp as wp
        from warpjld_kernels import touch_bulge as kernels

        for array in (self._lost, self._room):
            array.zero_()
        sides, give = [self._before, self.points, self._normals], self.parts.give
        out = [self._ring, self._lost, self._room]
        wp.launch(
            kernels.measure_displaced,
            len(self.points),
            inputs=[*sides, self.parts.part, self._active, give, *self._rows],
            outputs=out,
            device="cpu",
        )
        wp.launch(
            kernels.bulge,
            len(self.points),
            inputs=[self._normals, self.parts.part, self.parts.thickness, _BULGE * SHARE, *out],
            outputs=[self.points],
            device="cpu",
        )
