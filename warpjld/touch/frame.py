"""Separation of overlapping parts of one frame's surface: detection of overlaps, then displacement of both sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from warpjld.covering.binding import smoothstep
from warpjld.touch.host_arrays import floats, numbers, recorded, starts, vectors
from warpjld.touch.part_trees import part_trees
from warpjld.touch.patches import Patches

__all__ = ["FULL", "NONE", "SHARE", "Bench", "Model", "Overlaps", "fade"]

SHARE = 1.0 / 3.0
"""Depth of overlaps relative to the local thickness up to which skin can yield; deeper ones are impossible poses.
Depths below are in units of this share."""

# the separated part of an overlap fades from all at a depth of FULL to nothing at NONE: at three, the middle of the
# flesh, the outward direction flips. With FULL = 2, overlaps of a closing fist disappeared in a few frames: 3 mm in one
# of 240, now 1
FULL, NONE = 1.0, 2.75
_SWEEPS = 2  # separation sweeps; a third separates hardly more and costs as much as the second
_SOFT = 0.05  # depth over which the weight of an overlap sets in
_JUST = 0.1  # initial depth of a pair of parts from which on it is separated in full
_CLEARANCE = 0.05  # distance by which both sides are moved beyond the common surface
_STIFFNESS = 0.1  # regularisation of the fit of planes: a smaller total weight gives a smaller displacement
_SWELLS = 1.1  # factor of a mesh's largest distance from its bones at rest, to allow for bending
# spacing, relative to a part's median thickness, of the probes that are tested first, and of the vertices that suffice
# where the probes' depth is larger than _FEW; the weight of all others fades over as much again
_PROBES, _APART, _FEW = 1.0, 0.3, 0.35
_ACTS_ON = 16  # capacity of the lists of samples that act on the parts, per vertex of the surface
_LANES = 8  # padding at the end of these lists, which are read eight entries at a time
_BULGE = 0.5  # largest height of a bulge


def fade(ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Separated share of an overlap by its largest depth in units of ``SHARE``: 1 up to ``FULL``, 0 from ``NONE``."""
    return smoothstep((NONE - ratio) / (NONE - FULL))


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Vertices of one frame that lie inside another part, N of them.

    Attributes:
        vertex: Their indices, shape (N,).
        part: Their parts, shape (N,).
        other: Parts they lie inside, shape (N,).
        depth: Penetration depth beyond the overlap at rest [m], shape (N,).
        ratio: The same relative to what skin can yield, shape (N,); above 1 the pose is impossible.
    """

    vertex: NDArray[np.int32]
    part: NDArray[np.int32]
    other: NDArray[np.int32]
    depth: NDArray[np.float64]
    ratio: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """Pose-independent data of a surface for separation.

    Attributes:
        patches: Its parts.
        smooth: Smoothing matrix, shape (V, V).
        at_rest: Penetration depth of every vertex at rest, which is subtracted from overlaps [m], shape (V,); None
            while that is measured: then overlaps count regardless of orientation.
        never: Pairs of parts that are allowed to overlap, shape (P, P).
        edge: Mean length of the edges at every vertex [m], shape (V,).
        joints: Number of joints of the skeleton, 0 where there is none.
        around: Largest distance of the mesh of every part from its bones [m], shape (P,).
    """

    patches: Patches
    smooth: csr_array
    at_rest: NDArray[np.float64] | None
    never: NDArray[np.bool_]
    edge: NDArray[np.float64]
    joints: int
    around: NDArray[np.float64]


class Bench:
    """Workspace of one thread: trees of the parts, fitted to every frame, arrays, and recorded kernel launches.

    Launches are recorded once, since packing their arguments would take as long as the kernels of a frame.
    """

    def __init__(self, model: Model, vertices: NDArray[np.floating]) -> None:
        import warp as wp

        wp.init()
        count, names = len(vertices), len(model.patches.names)
        self.points = vectors(vertices)
        self.joints = vectors(np.zeros((max(model.joints, 1), 3)))
        meshes = [model.patches.mesh(k) for k in range(names)]
        self.parts = self._parts(model, vertices, [faces for faces, _ in meshes])
        self.trees = part_trees(vertices, meshes, model.patches.thickness)
        self.samples = _no_samples(2 * count)
        faces = model.patches.faces
        order = np.argsort(faces.ravel(), kind="stable")
        around = faces[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)[order]
        star = [starts(np.bincount(faces.ravel(), minlength=count)), wp.array(around, dtype=wp.vec2i, device="cpu")]
        smooth = [numbers(model.smooth.indptr), numbers(model.smooth.indices), floats(model.smooth.data)]
        self._count = self.samples.count.numpy()
        self._wanted = wp.zeros(names, dtype=wp.int32, device="cpu")
        self._active = wp.zeros(names, dtype=wp.int32, device="cpu")
        self._shown = wp.zeros((names, names), dtype=float, device="cpu")
        self._deepest = wp.zeros((names, names), dtype=float, device="cpu")
        self._normals, self._moved, self._start = (wp.zeros(count, dtype=wp.vec3, device="cpu") for _ in range(3))
        self._lost, self._room = (wp.zeros(names, dtype=float, device="cpu") for _ in range(2))
        first, beside = model.patches.spaced(vertices, _PROBES)
        apart, _ = model.patches.spaced(vertices, _APART)
        tested = [np.flatnonzero(mask) for mask in (first, apart & ~first, ~apart & ~first)]
        self._record(star, smooth, tested, beside)
        filled = ("points", "joints", "_start", "_lost", "_room", "_shown", "_deepest", "_wanted", "_active")
        self._views = {name: getattr(self, name).numpy() for name in filled}  # made once: a call takes 20 µs
        self._found = [getattr(self.samples, n).numpy() for n in ("vertex", "own", "other", "depth", "ratio")]

    def _parts(self, model: Model, vertices: NDArray[np.floating], meshes: list[NDArray[np.int32]]) -> Any:
        """The kernels' struct ``touch_parts.Parts``."""
        import warp as wp
        from warpjld_kernels.touch_parts import Parts

        patches, names = model.patches, len(model.patches.names)
        corners = [np.unique(f) for f in meshes]
        joined = patches.joined
        empty = np.array([not len(f) for f in meshes], dtype=bool)
        beside = np.full((names, int(joined.sum(axis=1).max())), -1)
        for k, row in enumerate(joined):
            near = np.flatnonzero(row)
            beside[k, : len(near)] = near
        parts = Parts()
        parts.part = numbers(patches.part)
        parts.first_corner = starts([len(c) for c in corners])
        parts.corner = numbers(np.concatenate(corners))
        parts.apart = numbers(np.where(joined, 2, np.where(empty[:, None] | empty | model.never, 0, 1)))
        parts.beside = numbers(beside)
        parts.thickness = floats(patches.thickness)
        parts.give = floats(patches.give)
        members = np.bincount(patches.part, minlength=names)
        parts.give_of = floats(np.bincount(patches.part, patches.give, names) / np.maximum(members, 1))
        parts.at_rest = floats(np.zeros(len(vertices)) if model.at_rest is None else model.at_rest)
        a, b, c = (np.asarray(vertices, dtype=np.float64)[patches.faces[:, k]] for k in range(3))
        turns = np.cross(b - a, c - a).T
        areas = [np.bincount(patches.faces.ravel(), np.repeat(n, 3), len(vertices)) for n in turns]
        parts.area = floats(np.linalg.norm(areas, axis=0) / 6.0)
        parts.facing = 1.0 if model.at_rest is None else 0.0
        parts.edge = floats(model.edge)
        bones = patches.bones if model.joints else ((),) * names
        parts.first_bone = starts([len(of_part) for of_part in bones])
        flat = np.array([pair for of_part in bones for pair in of_part], dtype=np.int32).reshape(-1, 2)
        parts.bone = wp.array(flat, dtype=wp.vec2i, device="cpu")
        parts.around = floats(_SWELLS * model.around)
        return parts

    def _record(
        self, star: list[Any], smooth: list[Any], tested: list[NDArray[np.int64]], beside: NDArray[np.int64]
    ) -> None:
        """Record all kernel launches, from the faces around every vertex, the smoothing matrix, the three groups of
        vertices that are tested in turn, and the nearest probe of every vertex."""
        import warp as wp
        from warpjld_kernels import touch_beneath, touch_parts

        count, names = len(self.points), len(self._wanted)
        parts, points = self.parts, self.points
        low, high, reach_low, reach_high = (wp.zeros(names, dtype=wp.vec3, device="cpu") for _ in range(4))
        boxes = [reach_low, reach_high]
        self._everywhere = reach_low.numpy(), reach_high.numpy()
        pairs = wp.zeros(names, dtype=wp.int32, device="cpu")
        others = wp.zeros((names, names), dtype=wp.int32, device="cpu")
        plains = wp.zeros(count, dtype=float, device="cpu")
        units = wp.zeros(count, dtype=wp.vec3, device="cpu")
        self._find_pairs = [
            recorded(touch_parts.find_boxes, names, [points, parts], [low, high]),
            recorded(
                touch_parts.find_pairs,
                names,
                [parts, low, high, self._shown],
                [pairs, others, self._wanted, self._active],
            ),
        ]
        self._find_normals = recorded(
            touch_parts.find_normals,
            count,
            [points, parts.part, self._active, *star, parts.area],
            [self._normals, units, plains],
        )
        self._fit_trees = recorded(
            touch_beneath.fit_trees, names, [self._wanted, points, units, plains, self.trees], []
        )
        found = [points, units, plains, self.trees, low, high, pairs, others]
        self._record_samples([*found, self.joints, *boxes], tested, beside)
        self._record_parting(boxes, smooth)

    def _record_samples(self, frame: list[Any], tested: list[NDArray[np.int64]], beside: NDArray[np.int64]) -> None:
        """Record the launches that find samples: probes first, then the vertices that these leave to be tested."""
        import warp as wp
        from warpjld_kernels import touch_parting, touch_samples

        count, names, parts = len(self.points), len(self._wanted), self.parts
        probed, apart, others = (wp.ones((names, names), dtype=float, device="cpu") for _ in range(3))
        self._pair_weights = apart.numpy(), others.numpy()
        deep = wp.zeros((names, names), dtype=float, device="cpu")
        ratio = wp.zeros(count + 1, dtype=float, device="cpu")
        none, probe = numbers(np.full(count, count)), numbers(beside)
        self._probe, *self._find_samples = (
            recorded(
                touch_samples.find_samples,
                len(vertices),
                [numbers(vertices), weight, near, deep, *frame, parts, SHARE, _SOFT, NONE],
                [ratio, self._deepest, self.samples],
            )
            for vertices, weight, near in zip(tested, (probed, apart, others), (none, probe, none), strict=True)
        )
        self._choose = recorded(
            touch_parting.choose_pair_weights, (names, names), [self._deepest, _FEW, NONE], [apart, others, deep]
        )
        # by the depths before separation in every sweep, or a partial separation would increase with each
        self._fade = recorded(
            touch_parting.fade_pairs, (names, names), [parts, self._deepest, FULL, NONE, _JUST], [self._shown]
        )

    def _record_parting(self, boxes: list[Any], smooth: list[Any]) -> None:
        """Record the launches that separate parts and restore their volume."""
        import warp as wp
        from warpjld_kernels import touch_bulge, touch_parting

        count, names = len(self.points), len(self._wanted)
        parts, points, normals, samples = self.parts, self.points, self._normals, self.samples
        assigned = self._assigned = touch_parting.Assigned()
        assigned.first = wp.zeros(names + 1, dtype=wp.int32, device="cpu")
        assigned.last = wp.zeros(names, dtype=wp.int32, device="cpu")
        assigned.sample = wp.zeros(_ACTS_ON * count, dtype=wp.int32, device="cpu")
        assigned.ball = wp.zeros((4, _ACTS_ON * count + _LANES), dtype=float, device="cpu")
        assigned.lower, assigned.upper = boxes
        self._assign = recorded(touch_parting.assign_samples, 1, [samples, self._shown, parts, assigned], [])
        self._part = [
            recorded(
                touch_parting.part_surfaces,
                count,
                [points, normals, samples, self._shown, assigned, parts, _CLEARANCE, _SOFT, _STIFFNESS],
                [self._moved],
            ),
            recorded(touch_parting.move, count, [self._moved], [points]),
        ]
        displaced = [wp.zeros(count, dtype=float, device="cpu"), self._lost, self._room]
        self._bulge = [
            recorded(
                touch_bulge.measure_displaced,
                count,
                [self._start, points, normals, parts.part, assigned.first, parts.give, *smooth],
                displaced,
            ),
            recorded(
                touch_bulge.bulge,
                count,
                [normals, parts.part, parts.thickness, _BULGE * SHARE, *displaced],
                [points],
            ),
        ]

    def measure(self, points: NDArray[np.floating], joints: NDArray[np.floating] | None) -> Overlaps:
        """Overlaps in a frame of points [m] (V, 3), with joints at [m] (J, 3) where these are known."""
        return self._overlaps(self._first(points, joints, everywhere=True))

    def part(self, points: NDArray[np.floating], joints: NDArray[np.floating] | None) -> Overlaps:
        """Separate the parts of a frame in place; arguments as of :meth:`measure`. Returns the overlaps before
        separation, those of pairs of parts too deep to be separated at some vertices only."""
        count = self._first(points, joints, everywhere=False)
        found = self._overlaps(count)
        if not count:
            return found
        there = self._views["points"]
        before = there.copy()
        self._views["_start"][...] = there
        for sweep in range(_SWEEPS):
            if sweep:
                count = self._find()
            else:
                self._fade.launch()
            if not count:
                break
            for command in (self._assign, *self._part):
                command.launch()
            if sweep == 0:
                self._views["_lost"][...] = 0.0
                self._views["_room"][...] = 0.0
                for command in self._bulge:
                    command.launch()
        at = (there != before).any(axis=1)
        points[at] = there[at]
        return found

    def _first(self, points: NDArray[np.floating], joints: NDArray[np.floating] | None, *, everywhere: bool) -> int:
        """Load a frame and find its samples, at all vertices or as the probes decide; returns their number."""
        self._views["points"][...] = points
        self._views["joints"][...] = np.nan if joints is None else joints
        self._views["_shown"][...] = 1.0
        self._views["_deepest"][...] = 0.0
        for box, end in zip(self._everywhere, (-np.inf, np.inf), strict=True):
            box[...] = end
        for weight in self._pair_weights:
            weight[...] = 1.0
        return self._find(choose=not everywhere)

    def _find(self, *, choose: bool = False) -> int:
        """Fill ``samples`` from ``points``; returns their number.

        In impossible poses most overlaps are too deep to be separated, which the probes show: with ``choose`` other
        vertices of such pairs are not tested.
        """
        wanted, active = self._views["_wanted"], self._views["_active"]
        wanted[...] = 0
        active[...] = 0
        self._count[...] = 0
        for command in self._find_pairs:
            command.launch()
        if not wanted.any():
            return 0
        self._find_normals.launch()
        self._fit_trees.launch()
        self._probe.launch()
        if choose:
            self._choose.launch()
        for command in self._find_samples:
            command.launch()
        return min(int(self._count[0]), len(self.samples.vertex))

    def _overlaps(self, count: int) -> Overlaps:
        """The first ``count`` samples as arrays of their own."""
        vertex, own, other, depth, ratio = (values[:count].copy() for values in self._found)
        return Overlaps(vertex, own, other, depth.astype(np.float64), ratio.astype(np.float64))


def _no_samples(room: int) -> Any:
    """The kernels' struct ``touch_samples.Samples`` with capacity for ``room`` samples."""
    import warp as wp
    from warpjld_kernels.touch_samples import Samples

    samples = Samples()
    for name, kind in Samples.vars.items():
        setattr(samples, name, wp.zeros(1 if name == "count" else room, dtype=kind.type.dtype, device="cpu"))
    return samples
