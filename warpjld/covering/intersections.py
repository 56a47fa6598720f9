"""Self-intersections of a surface: pairs of intersecting faces, and whether they belong to one part or to two.

Two faces cross where an edge of one passes through the other from one side to the other. Faces that only touch, or are
coplanar, do not cross. Of two faces with one common vertex only the edges opposite to it are tested; two with a common
edge are not tested.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.skeleton.hand import DIGITS

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["Crossings", "Parts", "crossing_faces", "other_pairs", "surface_parts"]

_CHUNK = 200_000  # pairs tested at a time, which bounds memory


@dataclass(frozen=True)
class Parts:
    """Parts of a surface that may touch one another: digits, palm, limbs.

    Attributes:
        names: E.g. ``left.index``, ``left.palm``, ``right.elbow``.
        of_face: Part of every face, shape (T,).
    """

    names: tuple[str, ...]
    of_face: NDArray[np.int32]


@dataclass(frozen=True)
class Crossings:
    """Pairs of intersecting faces of one frame, shape (N, 2), the smaller index first."""

    pairs: NDArray[np.int32]

    @property
    def faces(self) -> NDArray[np.int32]:
        """Indices of the faces that cross any other, ascending."""
        return np.unique(self.pairs)

    def contact(self, parts: Parts) -> Crossings:
        """Pairs of faces of different parts, such as two digits, or a digit and the palm."""
        return Crossings(self.pairs[self._differ(parts)])

    def folds(self, parts: Parts) -> Crossings:
        """Pairs of faces of the same part, whose surface has passed through itself."""
        return Crossings(self.pairs[~self._differ(parts)])

    def summary(self, parts: Parts) -> dict[str, int]:
        """Number of faces involved by pair of parts, e.g. {"left.index × left.palm": 12}."""
        label = np.sort(parts.of_face[self.pairs], axis=1)
        out: dict[str, int] = {}
        for a, b in np.unique(label, axis=0).tolist():
            faces = np.unique(self.pairs[(label == (a, b)).all(axis=1)])
            out[parts.names[a] if a == b else f"{parts.names[a]} × {parts.names[b]}"] = len(faces)
        return out

    def _differ(self, parts: Parts) -> NDArray[np.bool_]:
        label = parts.of_face[self.pairs]
        return np.asarray(label[:, 0] != label[:, 1])


def crossing_faces(
    vertices: ArrayLike,
    faces: NDArray[np.int32],
    wanted: Callable[[NDArray[np.int32]], NDArray[np.bool_]] | None = None,
) -> Crossings:
    """All crossing pairs of faces of a surface.

    Args:
        vertices: Positions [m], shape (V, 3).
        faces: Triangles, shape (T, 3).
        wanted: Filter of candidate pairs (N, 2), returns a mask (N,); by default all are tested.
    """
    points = np.asarray(vertices, dtype=np.float64)
    points = points - points.mean(axis=0)
    pairs = _overlapping(points, faces)
    if wanted is not None:
        pairs = pairs[wanted(pairs)]
    kept = [part[_cross(points, faces, part)] for part in np.array_split(pairs, max(len(pairs) // _CHUNK, 1))]
    return Crossings(np.concatenate(kept).astype(np.int32))


def other_pairs(pairs: NDArray[np.integer], known: NDArray[np.integer], count: int) -> NDArray[np.int64]:
    """Those pairs (N, 2) of ``count`` faces that are not among known ones (M, 2), the smaller index first in both."""
    keys, before = (some.astype(np.int64) @ [count, 1] for some in (pairs, known))
    return pairs[~np.isin(keys, before)].astype(np.int64)


def surface_parts(covering: Covering) -> Parts:
    """Part of every face by the largest sum of its operators' weights: digits, limbs, and the palm (metacarpals and
    carpus together)."""
    names: list[str] = []
    part_of_fan = []
    for fan in covering.fans:
        side, _, rest = fan.name.rpartition(".") if fan.name.count(".") < 2 else fan.name.partition(".")
        head = rest.partition(".")[0]
        name = fan.name
        if head in DIGITS:
            name = f"{side}.{head}".lstrip(".")
        elif head in ("palm", "carpus", "wrist"):
            name = f"{side}.palm".lstrip(".")
        if name not in names:
            names.append(name)
        part_of_fan.append(names.index(name))
    share = np.zeros((len(covering.domains), len(names)))
    for fan_number, part in enumerate(part_of_fan):
        share[:, part] += covering.domains[:, fan_number]
    of_face = share[covering.surface.faces].sum(axis=1).argmax(axis=1)
    return Parts(tuple(names), of_face.astype(np.int32))


def _overlapping(points: NDArray[np.float64], faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """Pairs of faces with at most one common vertex whose bounding boxes overlap, shape (N, 2)."""
    import warp as wp
    from warpjld_kernels.overlaps import overlapping_boxes

    wp.init()
    device = "cpu"
    corners = points[faces]
    margin = 1e-6 * float(np.linalg.norm(np.ptp(points, axis=0)))  # more than float32 loses
    lower = wp.array((corners.min(axis=1) - margin).astype(np.float32), dtype=wp.vec3, device=device)
    upper = wp.array((corners.max(axis=1) + margin).astype(np.float32), dtype=wp.vec3, device=device)
    triangles = wp.array(np.ascontiguousarray(faces, dtype=np.int32), dtype=wp.vec3i, device=device)
    bvh = wp.Bvh(lower, upper)
    count = wp.empty(len(faces), dtype=wp.int32, device=device)
    none = wp.empty(0, dtype=wp.int32, device=device)
    box = [bvh.id, lower, upper, triangles]
    wp.launch(overlapping_boxes, len(faces), inputs=[*box, none], outputs=[count, none], device=device)
    counts = count.numpy()
    first = np.cumsum(counts, dtype=np.int64) - counts
    others = wp.empty(int(counts.sum()), dtype=wp.int32, device=device)
    begin = wp.array(first.astype(np.int32), dtype=wp.int32, device=device)
    wp.launch(overlapping_boxes, len(faces), inputs=[*box, begin], outputs=[count, others], device=device)
    return np.column_stack([np.repeat(np.arange(len(faces), dtype=np.int32), counts), others.numpy()])


def _cross(points: NDArray[np.float64], faces: NDArray[np.int32], pairs: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Which pairs of faces (N, 2) cross, shape (N,)."""
    out = np.zeros(len(pairs), dtype=bool)
    first, second = faces[pairs[:, 0]], faces[pairs[:, 1]]
    same = first[:, :, None] == second[:, None, :]
    single = same.any(axis=(1, 2))
    # rotate a common vertex to the first place in both, so that the edge opposite to it is always the one from 1 to 2
    a, b = (
        points[np.take_along_axis(f, (np.where(single, s.argmax(axis=1), 0)[:, None] + np.arange(3)) % 3, axis=1)]
        for f, s in ((first, same.any(axis=2)), (second, same.any(axis=1)))
    )
    tolerance = 1e-13 * float(np.abs(points).max(initial=0.0))
    side_a, side_b = _heights(a, b, tolerance), _heights(b, a, tolerance)
    for start, end in ((1, 2), (0, 1), (0, 2)):
        tested = ~out if start == 1 else ~out & ~single
        for edge, other, side in ((a, b, side_a), (b, a, side_b)):
            rows = np.flatnonzero(tested & (side[:, start] * side[:, end] < 0.0))
            passes = _inside(edge[rows, start], edge[rows, end], other[rows])
            out[rows[passes]] = True
    return out


def _heights(a: NDArray[np.float64], b: NDArray[np.float64], tolerance: float) -> NDArray[np.float64]:
    """Signed distance of the corners of faces a from the planes of faces b [m], 0 within rounding, shape (N, 3)."""
    normal = np.cross(b[:, 1] - b[:, 0], b[:, 2] - b[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0.0, length, 1.0)
    height = np.einsum("nki,ni->nk", a - b[:, :1], normal)
    return np.where(np.abs(height) > tolerance, height, 0.0)


def _inside(start: NDArray[np.float64], end: NDArray[np.float64], face: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether lines through start and end pass through faces or their borders (three triple products of one sign)."""
    along = end - start
    corner = face - start[:, None]
    turns = [(along * np.cross(corner[:, i], corner[:, j])).sum(axis=1) for i, j in ((0, 1), (1, 2), (2, 0))]
    low, high = np.minimum.reduce(turns), np.maximum.reduce(turns)
    return np.asarray((low >= 0.0) | (high <= 0.0))
