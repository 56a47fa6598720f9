"""Self-contact of the skin for display: overlapping parts are separated, and the displaced volume bulges beside them.

Without forces or equilibrium: contact with forces is PRESS (:mod:`warpjld.simulation`). The two sides of every bent
joint are separated at its bisecting plane. Then vertices that lie inside another part are found; each defines a plane
in which it and that part shall meet, and both sides are moved by a least squares fit to the planes around, which is
smooth over the surface. The volume lost by this is restored around it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from queue import SimpleQueue
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from warpjld.covering.intersections import crossing_faces, other_pairs
from warpjld.errors import InputError
from warpjld.geometry.segment_distance import segment_distance
from warpjld.runtime.threads import in_threads, threads_for
from warpjld.skeleton.kinematics import Poses
from warpjld.touch.creases import Creases
from warpjld.touch.frame import SHARE, Bench, Model, Overlaps
from warpjld.touch.patches import Patches, patches_of
from warpjld.touch.smoothing import edge_lengths, skin_smoothing

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["SHARE", "Touch", "Touched"]

_NOISE = 1e-6  # margin of overlaps at rest, relative to the surface's size
_SPLIT_BELOW = 8_000  # smallest number of vertices × frames worth a thread of its own


@dataclass(frozen=True)
class Touched:
    """The deepest overlap of one part in one frame, where it is deeper than skin can yield.

    Attributes:
        part: The part, e.g. ``left.index.knuckle2``.
        other: Part or object that it lies inside.
        frame: Frame number.
        depth: Depth [m].
    """

    part: str
    other: str
    frame: int
    depth: float


class Touch:
    """Separation of overlapping parts of a covering's deformed surface; made once, applied to any frames.

    Args:
        patches: The surface's parts.
        vertices: Rest positions [m], shape (V, 3). Overlaps at rest are kept, to their depth.
        creases: The joints whose two sides are separated; none by default.
        joints: Rest positions of the joints that the patches' bones refer to [m], shape (J, 3).

    Raises:
        InputError: Compliances that are negative or not finite.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering, motion = wj.bind(hand), wj.Motion()
        >>> for joint, angle in (("index.base", 1.4), ("index.knuckle2", 1.7), ("index.knuckle3", 1.2)):  # rad
        ...     motion.set_key(f"{joint}.flexion", 0, angle)
        >>> poses = motion.poses(hand.skeleton)
        >>> parted, deep = wj.Touch.of(covering).apply(covering.deform(poses), poses)
        >>> parted.shape
        (1, ..., 3)
    """

    def __init__(
        self,
        patches: Patches,
        vertices: NDArray[np.float64],
        *,
        creases: Creases | None = None,
        joints: NDArray[np.float64] | None = None,
    ) -> None:
        if (patches.give < 0.0).any() or not np.isfinite(patches.give).all():
            raise InputError("touch: compliances must be finite numbers, 0 or above")
        self.patches = patches
        self.creases = creases
        self._vertices = vertices
        edge = edge_lengths(vertices, patches.faces)
        smooth = creases.smooth if creases is not None else skin_smoothing(vertices, patches)
        count = len(vertices)
        self.coarse = patches.coarse(edge)
        never = self.coarse[:, None] | self.coarse
        around = np.zeros(len(patches.names)) if joints is None else _around(patches, vertices, joints)
        bones = 0 if joints is None else len(joints)
        self._model = Model(patches, smooth, None, never, edge, bones, around)
        found = Bench(self._model, vertices).measure(vertices, joints)
        at_rest = np.zeros(count)
        # with a margin for single precision, which depends on the position
        noise = _NOISE * float(np.linalg.norm(np.ptp(vertices, axis=0)))
        np.maximum.at(at_rest, found.vertex, 1.001 * found.depth + noise)
        self._model = replace(self._model, at_rest=at_rest, never=never | self._nested(found))
        self._benches: list[Bench] = []

    def __repr__(self) -> str:
        return f"Touch({len(self.patches.names)} parts of {len(self._vertices)} vertices)"

    def _nested(self, found: Overlaps) -> NDArray[np.bool_]:
        """Pairs of parts of different connected components that overlap at rest, as pieces of a jointed doll, shape
        (P, P)."""
        out = np.zeros((len(self.patches.names),) * 2, dtype=bool)
        shells = [set(self.patches.shell[self.patches.part == k].tolist()) for k in range(len(out))]
        for a, b in {(int(p), int(o)) for p, o in zip(found.part, found.other, strict=True)}:
            out[a, b] = out[b, a] = out[a, b] or not shells[a] & shells[b]
        return out

    @classmethod
    def of(cls, covering: Covering) -> Touch:
        """Contact of a covering's own parts, all equally compliant."""
        patches = patches_of(covering)
        vertices, joints = covering.surface.vertices, covering.skeleton.rest
        return cls(patches, vertices, creases=Creases.of(covering, patches), joints=joints)

    @property
    def smooth(self) -> csr_array:
        """Smoothing matrix with the thickness of the flesh as its length scale, shape (V, V)."""
        return self._model.smooth

    def apply(
        self, points: NDArray[np.floating], poses: Poses | None = None, *, first: int = 0, threads: int | None = None
    ) -> tuple[NDArray[np.floating], list[Touched]]:
        """Separate overlapping parts.

        Args:
            points: Deformed vertices [m], shape (F, V, 3).
            poses: The poses they were deformed by; without them the two sides of joints are not separated.
            first: Number of the first frame, for reports.
            threads: CPU threads to split the frames over; by default all cores where that pays.

        Returns:
            The vertices, of the same type, unchanged to the bit away from overlaps; and the deepest overlap of every
            part and frame where it is deeper than skin can yield.
        """
        out, found = self.parted(points, poses, threads=threads)
        return out, [deep for k, overlaps in enumerate(found) for deep in self._deep(overlaps, first + k)]

    def parted(
        self, points: NDArray[np.floating], poses: Poses | None = None, *, threads: int | None = None
    ) -> tuple[NDArray[np.floating], list[Overlaps]]:
        """As :meth:`apply`, with all overlaps of every frame after the two sides of joints were separated."""
        moved, found = self._each(points, poses, threads, Bench.part)
        if points.dtype == np.float32:
            return moved, found
        same = (moved == points.astype(np.float32)).all(axis=2, keepdims=True)
        return np.where(same, points, moved), found

    def measured(
        self, points: NDArray[np.floating], poses: Poses | None = None, *, threads: int | None = None
    ) -> list[Overlaps]:
        """Overlaps that :meth:`apply` would separate in every frame."""
        return self._each(points, poses, threads, Bench.measure)[1]

    def _each(
        self,
        points: NDArray[np.floating],
        poses: Poses | None,
        threads: int | None,
        work: Callable[..., Overlaps],
    ) -> tuple[NDArray[np.float32], list[Overlaps]]:
        """Apply ``work`` to every frame after separating the two sides of joints; vertices and overlaps of each."""
        count = len(self.patches.part)
        if points.ndim != 3 or points.shape[1:] != (count, 3):
            raise InputError(f"touch: want points of shape (frames, {count}, 3), got {points.shape}")
        if poses is not None and len(poses) != len(points):
            raise InputError(f"touch: {len(points)} frames of points, but {len(poses)} poses")
        import warp as wp
        from warpjld_kernels.touch_samples import find_samples

        moved = np.array(points, dtype=np.float32)
        found: dict[int, Overlaps] = {}
        places = [None] * len(points) if poses is None else poses.positions
        planes = None if self.creases is None or poses is None else self.creases.planes(poses)

        if threads is None:
            threads = threads_for(moved.shape[0] * count, _SPLIT_BELOW)
        free: SimpleQueue[Bench] = SimpleQueue()
        for bench in self._made(max(1, min(threads, len(points)))):
            free.put(bench)

        def span(begin: int, end: int) -> None:
            bench = free.get()
            for k in range(begin, end):
                found[k] = work(bench, moved[k], places[k], None if planes is None else (planes[0][k], planes[1][k]))

        in_threads(span, len(points), threads, find_samples, wp.get_device("cpu"))
        return moved, [found[k] for k in range(len(points))]

    def new_crossings(self, pairs: NDArray[np.integer]) -> NDArray[np.int64]:
        """Those pairs of crossing faces (N, 2) that do not cross at rest."""
        return other_pairs(pairs, self._crossing_at_rest, len(self.patches.faces))

    @cached_property
    def _crossing_at_rest(self) -> NDArray[np.int32]:
        """Pairs of faces that cross at rest, shape (R, 2)."""
        return crossing_faces(self._vertices, self.patches.faces).pairs

    def _made(self, count: int) -> list[Bench]:
        """Workspaces for ``count`` threads; Warp's meshes cannot be created in several threads at once."""
        while len(self._benches) < count:
            self._benches.append(Bench(self._model, self._vertices, self.creases))
        return self._benches[:count]

    def _deep(self, found: Overlaps, frame: int) -> list[Touched]:
        """The deepest overlap of every part, where it is deeper than skin can yield."""
        deep = np.flatnonzero(found.ratio > 1.0)
        by_part = {}
        for i in deep[np.argsort(found.depth[deep])].tolist():  # ascending, so that the deepest remains
            part = self.patches.names[found.part[i]]
            by_part[part] = Touched(part, self.patches.names[found.other[i]], frame, float(found.depth[i]))
        return list(by_part.values())


def _around(patches: Patches, vertices: NDArray[np.float64], joints: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest distance of the mesh of every part from its bones [m], shape (P,)."""
    out = np.zeros(len(patches.names))
    for k, bones in enumerate(patches.bones):
        corners = np.unique(patches.mesh(k)[0])
        if len(corners) and bones:
            out[k] = segment_distance(vertices[corners], joints, list(bones)).max()
    return out
