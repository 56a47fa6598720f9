"""The paper's hard-edged assignment: every vertex on one segment, or between two palm neighbours (A §4–§5.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.operators import Fan, segment_ends
from warpjld.covering.parameters import Parameters
from warpjld.covering.segment_table import SNAP, SegmentTable
from warpjld.skeleton.tree import Skeleton

__all__ = ["PaperPlaces", "paper_places"]

_SAME_DOMAIN = 1e-6  # weights of operators that differ by less (error of the solvers) count as equal


@dataclass(frozen=True, eq=False)
class PaperPlaces:
    """Coordinates of V vertices on their segments.

    Attributes:
        ends: Proximal and distal joint of every segment, shape (S, 2).
        muscle: Whether a segment's internal muscle inflates, shape (S,).
        segment: The segment a vertex lies on, and the neighbouring segment on whose side it lies, shape (V, 2).
        ratio: Its projections on both, shape (V, 2) (R37, C1).
        across: Its projection on the virtual segment from the first to the second, shape (V,) (R53).
        between: Whether it lies in areas 2, 5, 8 of the palm, shape (V,) (R49).
        external: Whether it lies on the external side, shape (V,) (R45).
        rigid: Joint whose bone a rigid vertex follows, -1 for flesh, shape (V,); for rigid vertices the other
            attributes have no meaning.
        whole: Whether it belongs to a shell that moves rigidly with the place beneath it, neither rounded nor swollen,
            shape (V,).
    """

    ends: NDArray[np.int32]
    muscle: NDArray[np.bool_]
    segment: NDArray[np.int32]
    ratio: NDArray[np.float64]
    across: NDArray[np.float64]
    between: NDArray[np.bool_]
    external: NDArray[np.bool_]
    rigid: NDArray[np.int32]
    whole: NDArray[np.bool_]

    def taken_from(self, vertex: NDArray[np.int64], whole: NDArray[np.bool_]) -> PaperPlaces:
        """Places copied to every vertex from another, shape (V,), for shells that lie on the skin, of which those of
        ``whole`` (V,) move rigidly, and for coincident borders (R18); rigid vertices keep their own."""
        chosen = np.where((self.rigid >= 0) | (self.rigid[vertex] >= 0), np.arange(len(vertex)), vertex)
        moved = {name: getattr(self, name)[chosen] for name in ("segment", "ratio", "across", "between", "external")}
        return replace(self, **moved, whole=whole)


def paper_places(
    vertices: NDArray[np.float64],
    skeleton: Skeleton,
    groups: tuple[Fan, ...],
    domains: NDArray[np.float64],
    parameters: Parameters,
    rigid: NDArray[np.int32] | None = None,
) -> PaperPlaces:
    """Assign every vertex to its strongest operator, and inside the palm to one of the nine areas (A Fig. 7).

    Inside the palm a vertex belongs to the nearest segment; its neighbour is the one on whose side the vertex lies.
    External vertices within the proximity of either segment belong to it (columns 1-4-7 and 3-6-9), else they lie in
    between. Internal vertices lie in between where they project on the virtual segment: no proximities there (C10).

    Borders and ties are decided with a margin, so that rounding does not matter: of equal operators and segments the
    first is taken, of equal neighbours the next one; a vertex on the border between the sides is external, and one on
    the border of an in-between area belongs to the segment.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        skeleton: The rest skeleton.
        groups: Operators, from :func:`~warpjld.covering.operators.fans`.
        domains: Weight of every fan, shape (V, fans).
        parameters: Their proximities bound the areas.
        rigid: Joint that a vertex follows rigidly, -1 for flesh, shape (V,); by default all vertices are flesh.
    """
    ends = segment_ends(groups)
    table = SegmentTable.build(skeleton, ends)
    count = len(vertices)
    ratio = table.project(vertices)
    segment = np.zeros((count, 2), dtype=np.int32)
    across, between = np.zeros(count), np.zeros(count, dtype=bool)
    owner = _first_largest(domains, _SAME_DOMAIN)
    tie = SNAP * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    first = 0
    for f, fan in enumerate(groups):
        size = len(fan.segments)
        members = np.flatnonzero(owner == f)
        segment[members] = first
        if size > 1 and members.size:
            inside = slice(first, first + size)
            chosen = _palm_place(vertices[members], table, ratio[members, inside], inside, parameters, tie)
            segment[members], across[members], between[members] = first + chosen[0], chosen[1], chosen[2]
        first += size
    both = np.take_along_axis(ratio, segment, axis=1)
    external = _height(vertices, table, segment, both, np.where(between, across, 0.0)) >= -tie
    muscle = np.array([fan.muscle for fan in groups for _ in fan.segments])
    rigid = np.full(count, -1, dtype=np.int32) if rigid is None else rigid
    whole = np.zeros(count, dtype=bool)
    return PaperPlaces(ends, muscle, segment, both, across, between, external, rigid, whole)


def _palm_place(
    points: NDArray[np.float64],
    table: SegmentTable,
    ratio: NDArray[np.float64],
    inside: slice,
    parameters: Parameters,
    tie: float,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Segment and neighbour as indices in the fan (n, 2), ratio across (n,), and whether in between (n,)."""
    rows = np.arange(len(points))
    feet = table.start[inside] + ratio[..., None] * table.along[inside]
    size = feet.shape[1]
    nearest = _first_largest(-np.linalg.norm(points[:, None] - feet, axis=2), tie)

    def towards(neighbour: NDArray[np.int64]) -> NDArray[np.float64]:
        virtual = feet[rows, neighbour] - feet[rows, nearest]
        squared = (virtual**2).sum(axis=1)
        apart = squared > (1e-3 * np.linalg.norm(table.along[inside], axis=1).max()) ** 2
        r = ((points - feet[rows, nearest]) * virtual).sum(axis=1) / np.where(apart, squared, 1.0)
        return np.where((neighbour != nearest) & apart, r, -np.inf)

    before, after = np.maximum(nearest - 1, 0), np.minimum(nearest + 1, size - 1)
    back, forth = towards(before), towards(after)
    neighbour = np.where(back > forth + SNAP, before, after)
    across = np.where(back > forth + SNAP, back, forth)

    place = np.clip(ratio, 0.0, 1.0)
    joints = table.ends[inside]
    width = (1.0 - place) * parameters.proximity[joints[:, 0], 0] + place * parameters.proximity[joints[:, 1], 1]
    here, there = width[rows, nearest], width[rows, neighbour]
    total = np.maximum(here + there, 1.0)  # proximities that sum to more than 1 are scaled, with no area in between
    alone = np.isneginf(across)
    normal = _blended(table, inside.start + nearest, place[rows, nearest])
    external = ((points - feet[rows, nearest]) * normal).sum(axis=1) >= -tie
    low = np.where(external, here / total, 0.0)
    high = np.where(external, 1.0 - there / total, 1.0)
    between = ~alone & (across > low + SNAP) & (across < high - SNAP)
    on_neighbour = ~alone & (across > low + SNAP) & (across >= high - SNAP)  # wrong assignments are corrected (R68)
    segment = np.where(on_neighbour, neighbour, nearest)
    other = np.where(on_neighbour, nearest, neighbour)
    return np.column_stack([segment, other]), np.where(between, across, 0.0), between


def _first_largest(values: NDArray[np.float64], tie: float) -> NDArray[np.int64]:
    """Column of the first value within ``tie`` of the largest one, for every row."""
    first: NDArray[np.int64] = (values >= values.max(axis=1, keepdims=True) - tie).argmax(axis=1)
    return first


def _height(
    points: NDArray[np.float64],
    table: SegmentTable,
    segment: NDArray[np.int32],
    ratio: NDArray[np.float64],
    across: NDArray[np.float64],
) -> NDArray[np.float64]:
    """(vertex − projection) · normal [m], of the sign of R45's cosine, shape (V,)."""
    feet = table.start[segment] + ratio[..., None] * table.along[segment]
    normals = [_blended(table, segment[:, k], np.clip(ratio[:, k], 0.0, 1.0)) for k in (0, 1)]
    part = across[:, None]
    foot = (1.0 - part) * feet[:, 0] + part * feet[:, 1]
    normal = (1.0 - part) * normals[0] + part * normals[1]
    height: NDArray[np.float64] = ((points - foot) * normal).sum(axis=1)
    return height


def _blended(table: SegmentTable, segment: NDArray, ratio: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normals interpolated between the two ends of segments, not normalised, shape (n, 3)."""
    blend = ratio[:, None]
    normal: NDArray[np.float64] = (1.0 - blend) * table.normals[segment, 0] + blend * table.normals[segment, 1]
    return normal
