"""Separation of overlapping parts of one frame's surface: detection of overlaps, then displacement of both sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from warpjld.covering.binding import smoothstep
from warpjld.touch.host_arrays import floats, numbers, recorded, vectors
from warpjld.touch.part_arrays import normal_arrays, part_arrays
from warpjld.touch.part_trees import part_trees
from warpjld.touch.patches import Patches

if TYPE_CHECKING:
    from warpjld.touch.creases import Creases

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
# spacing, relative to a part's median thickness, of the probes that are tested first, and of the vertices that suffice
# where the probes' depth is larger than _FEW; the weight of all others fades over as much again
_PROBES, _APART, _FEW = 1.0, 0.3, 0.35
_ROUNDS = 3  # rounds in which vertices are tested: probes, spaced vertices, all others
_ACTS_ON = 16  # capacity of the lists of samples that act on the parts, per vertex of the surface
_LANES = 8  # padding at the end of these lists, which are read eight entries at a time
_BULGE = 0.5  # largest height of a bulge

_Planes = tuple[NDArray[np.float32], NDArray[np.float32]]  # of joints in one frame, as ``Creases.planes`` has them


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

    def __init__(self, model: Model, vertices: NDArray[np.floating], creases: Creases | None = None) -> None:
        import warp as wp

        wp.init()
        count, names = len(vertices), len(model.patches.names)
        self.points = vectors(vertices)
        self._creases = None if creases is None else creases.bench(self.points)
        self.joints = vectors(np.zeros((max(model.joints, 1), 3)))
        meshes = [model.patches.mesh(k) for k in range(names)]
        first, beside = model.patches.spaced(vertices, _PROBES)
        apart, _ = model.patches.spaced(vertices, _APART)
        group = np.where(first, 0, np.where(apart, 1, 2))
        self.parts = part_arrays(model, vertices, [faces for faces, _ in meshes], group)
        self.trees = part_trees(vertices, meshes, model.patches.thickness)
        self.samples = _no_samples(2 * count)
        self._normals = normal_arrays(vertices, model.patches.faces)
        self._known = self._normals.known.numpy()
        smooth = [numbers(model.smooth.indptr), numbers(model.smooth.indices), floats(model.smooth.data)]
        self._count = self.samples.count.numpy()
        self._wanted = wp.zeros(names, dtype=wp.int32, device="cpu")
        self._shown = wp.zeros((names, names), dtype=float, device="cpu")
        self._deepest = wp.zeros((names, names), dtype=float, device="cpu")
        self._moved, self._start = (wp.zeros(count, dtype=wp.vec3, device="cpu") for _ in range(2))
        self._record(smooth, beside)
        filled = ("points", "joints", "_start", "_shown", "_deepest", "_wanted")
        self._views = {name: getattr(self, name).numpy() for name in filled}  # made once: a call takes 20 µs
        self._found = [getattr(self.samples, n).numpy() for n in ("vertex", "own", "other", "depth", "ratio")]

    def _record(self, smooth: list[Any], beside: NDArray[np.int64]) -> None:
        """Record all kernel launches, from the smoothing matrix and the nearest probe of every vertex."""
        import warp as wp
        from warpjld_kernels import touch_parts, touch_trees

        count, names = len(self.points), len(self._wanted)
        parts, points = self.parts, self.points
        bounds = touch_parts.Bounds()
        for name, kind in touch_parts.Bounds.vars.items():
            setattr(bounds, name, wp.zeros(names, dtype=kind.type.dtype, device="cpu"))
        boxes = [wp.zeros(names, dtype=wp.vec3, device="cpu") for _ in range(2)]
        self._everywhere = tuple(box.numpy() for box in boxes)
        pairs = wp.zeros(names, dtype=wp.int32, device="cpu")
        others = wp.zeros((names, names), dtype=wp.int32, device="cpu")
        candidate = wp.zeros((_ROUNDS, count), dtype=wp.int32, device="cpu")
        number = wp.zeros(_ROUNDS, dtype=wp.int32, device="cpu")
        self._number = number.numpy()
        self._find_pairs = [
            recorded(touch_parts.find_bounds, names, [points, parts, bounds], []),
            recorded(touch_parts.find_pairs, names, [parts, bounds, self._shown], [pairs, others]),
            recorded(
                touch_parts.find_candidates,
                1,
                [points, parts, bounds, pairs, others, *boxes],
                [candidate, number, self._wanted],
            ),
        ]
        self._fit_trees = recorded(touch_trees.fit_trees, names, [self._wanted, points, self.trees], [])
        frame = [points, self._normals, self.trees, bounds, pairs, others, self.joints]
        self._record_samples([candidate, number], frame, beside)
        self._record_parting(boxes, smooth)

    def _record_samples(self, tested: list[Any], frame: list[Any], beside: NDArray[np.int64]) -> None:
        """Record the launches that find samples: probes first, then the vertices that these leave to be tested."""
        import warp as wp
        from warpjld_kernels import touch_parting, touch_samples

        count, names, parts = len(self.points), len(self._wanted), self.parts
        probed, apart, others = (wp.ones((names, names), dtype=float, device="cpu") for _ in range(_ROUNDS))
        self._pair_weights = apart.numpy(), others.numpy()
        deep = wp.zeros((names, names), dtype=float, device="cpu")
        ratio = wp.zeros(count + 1, dtype=float, device="cpu")
        self._ratio = ratio.numpy()
        none, probe = numbers(np.full(count, count)), numbers(beside)
        self._probe, *self._find_samples = (
            recorded(
                touch_samples.find_samples,
                1,
                [*tested, group, weight, near, deep, *frame, parts, SHARE, _SOFT, NONE],
                [ratio, self._deepest, self.samples],
            )
            for group, (weight, near) in enumerate(zip((probed, apart, others), (none, probe, none), strict=True))
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
        size = wp.zeros(count, dtype=float, device="cpu")
        self._part = [
            recorded(
                touch_parting.part_surfaces,
                names,
                [points, normals, samples, self._shown, assigned, parts, _CLEARANCE, _SOFT, _STIFFNESS],
                [self._moved],
            ),
            recorded(touch_parting.move, names, [self._start, self._moved, assigned, parts], [points, size]),
        ]
        ring, lost, room = (wp.zeros(rows, dtype=float, device="cpu") for rows in (count, names, names))
        self._bulge = [
            recorded(
                touch_bulge.measure_displaced,
                names,
                [self._start, points, size, normals, parts, assigned.first, *smooth],
                [ring, lost, room],
            ),
            recorded(touch_bulge.bulge, names, [normals, parts, _BULGE * SHARE, ring, lost, room], [points]),
        ]

    def measure(
        self, points: NDArray[np.floating], joints: NDArray[np.floating] | None, planes: _Planes | None = None
    ) -> Overlaps:
        """Overlaps in a frame of points [m] (V, 3), with joints at [m] (J, 3) where these are known, after the two
        sides of joints were separated at their planes, where these are given."""
        return self._overlaps(self._first(points, joints, planes, everywhere=True))

    def part(
        self, points: NDArray[np.floating], joints: NDArray[np.floating] | None, planes: _Planes | None = None
    ) -> Overlaps:
        """Separate the parts of a frame in place; arguments as of :meth:`measure`. Returns the overlaps before
        separation, those of pairs of parts too deep to be separated at some vertices only."""
        count = self._first(points, joints, planes, everywhere=False)
        found = self._overlaps(count)
        there = self._views["points"]
        if count:
            self._views["_start"][...] = there
        for sweep in range(_SWEEPS if count else 0):
            if sweep:
                count = self._find()
            else:
                self._fade.launch()
            if not count:
                break
            for command in (self._assign, *self._part, *(self._bulge if sweep == 0 else ())):
                command.launch()
        points[...] = there
        return found

    def _first(
        self,
        points: NDArray[np.floating],
        joints: NDArray[np.floating] | None,
        planes: _Planes | None,
        *,
        everywhere: bool,
    ) -> int:
        """Load a frame and find its samples, at all vertices or as the probes decide; returns their number."""
        self._views["points"][...] = points
        if self._creases is not None and planes is not None:
            self._creases.part(*planes)
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
        wanted = self._views["_wanted"]
        wanted[...] = 0
        self._count[...] = 0
        self._number[...] = 0
        for command in self._find_pairs:
            command.launch()
        if not wanted.any():
            return 0
        self._ratio[...] = 0.0
        self._known[...] = 0
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
