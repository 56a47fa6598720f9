"""Binding: coordinates of every vertex relative to the segments whose operators move it (A §4, R34–R48).

They do not depend on the pose, and only the weights of palm segments depend on the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.operators import Fan, segment_ends
from warpjld.covering.parameters import Parameters
from warpjld.covering.segment_table import SegmentTable
from warpjld.skeleton.tree import Skeleton

__all__ = ["FLOOR", "OPERATORS", "SIDE_BAND", "STATIONS", "Anchors", "anchor", "smoothstep"]

OPERATORS = 4
"""Largest number of segments that move a vertex (the paper has one; more make the borders of domains soft)."""

STATIONS = 5
"""Number of places along a pair of neighbouring palm segments where the scale factor λ is evaluated; it is interpolated
linearly in between."""

# |cosine| below which the rules of the external and the internal side are blended: cross-sections near a joint stay
# upright on the external side and lean on the internal one, and a wider band shears the flanks less
SIDE_BAND = 0.75
# factor of proximities across the palm: along a segment there is one at either end, across it on one side only; the
# area between two segments then is broad, and its shear is spread
LATERAL = 0.6
FLOOR = 2e-2  # weight below which a segment is dropped; weights fade to zero there, so that they stay continuous
_ALIKE = 1e-3  # share of the largest weight that fading always leaves, where the first weight left out is as large
_TIES = 1e-9  # weights that differ by less, as sums in another order do, count as equal


@dataclass(frozen=True, eq=False)
class Anchors:
    """Coordinates of V vertices relative to up to ``OPERATORS`` segments each.

    Attributes:
        ends: Proximal and distal joint of every segment, shape (S, 2).
        muscle: Whether a segment's internal muscle inflates, shape (S,).
        stiff: Whether all flesh around a segment turns rigidly with its bone, as on a skull, shape (S,).
        rest: Vertices at rest [m], shape (V, 3).
        segment: Segments of a vertex, shape (V, 4).
        weight: Their weights, rows summing to one; unused ones are zero, shape (V, 4).
        ratio: Projection on the segment, 0 at the proximal joint, 1 at the distal one, clamped except beyond
            extremities, shape (V, 4) (R37, C1).
        side: 1 on the external side, 0 on the internal, blended over a band of R45's cosine, shape (V, 4).
        pairs: Segments of every pair of palm neighbours, shape (N, 2).
        pair: Palm pairs between which a vertex lies, shape (V, 2).
        between: Weight of the thickening by these pairs, 0 on either segment, 1 in the middle, shape (V, 2) (R44, R49).
        station: Position along these pairs, 0 … STATIONS − 1, shape (V, 2).
        rigid: Joint whose bone a rigid vertex follows, -1 for flesh, shape (V,). A rigid vertex has no weight on any
            segment.
    """

    ends: NDArray[np.int32]
    muscle: NDArray[np.bool_]
    stiff: NDArray[np.bool_]
    rest: NDArray[np.float64]
    segment: NDArray[np.int32]
    weight: NDArray[np.float64]
    ratio: NDArray[np.float64]
    side: NDArray[np.float64]
    pairs: NDArray[np.int32]
    pair: NDArray[np.int32]
    between: NDArray[np.float64]
    station: NDArray[np.float64]
    rigid: NDArray[np.int32]

    def __len__(self) -> int:
        return len(self.rest)


def anchor(
    vertices: NDArray[np.float64],
    skeleton: Skeleton,
    groups: tuple[Fan, ...],
    domains: NDArray[np.float64],
    parameters: Parameters,
    *,
    rigid: NDArray[np.int32] | None = None,
    chunk: int = 100_000,
) -> Anchors:
    """Compute the coordinates of vertices on the segments of their domains.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        skeleton: The rest skeleton.
        groups: Operators, from :func:`~warpjld.covering.operators.fans`.
        domains: Weight of every fan, shape (V, fans).
        parameters: Their proximities set how wide the areas between palm segments are (A Fig. 7).
        rigid: Joint that a vertex follows rigidly, -1 for flesh, shape (V,); by default all vertices are flesh.
        chunk: Vertices processed at a time, which bounds memory.
    """
    ends = segment_ends(groups)
    table = SegmentTable.build(skeleton, ends)
    pairs, pair_of_fan = _neighbour_pairs(groups)
    rows = [
        _anchor_chunk(vertices[i : i + chunk], table, groups, domains[i : i + chunk], parameters, pair_of_fan)
        for i in range(0, len(vertices), chunk)
    ]
    joined = [np.concatenate(column) for column in zip(*rows, strict=True)]
    segment, weight, ratio, side, pair, between, station = joined
    muscle = np.array([fan.muscle for fan in groups for _ in fan.segments])
    stiff = np.array([fan.stiff for fan in groups for _ in fan.segments])
    rigid = np.full(len(vertices), -1, dtype=np.int32) if rigid is None else rigid
    flesh = (rigid < 0)[:, None]
    weight, between = weight * flesh, between * flesh
    return Anchors(ends, muscle, stiff, vertices, segment, weight, ratio, side, pairs, pair, between, station, rigid)


def _neighbour_pairs(groups: tuple[Fan, ...]) -> tuple[NDArray[np.int32], dict[int, int]]:
    """All pairs of neighbouring segments, shape (N, 2), and the index of each fan's first pair."""
    pairs: list[tuple[int, int]] = []
    first: dict[int, int] = {}
    segment = 0
    for f, fan in enumerate(groups):
        first[f] = len(pairs)
        pairs.extend((segment + k, segment + k + 1) for k in range(len(fan.segments) - 1))
        segment += len(fan.segments)
    return np.array(pairs, dtype=np.int32).reshape(-1, 2), first


def _anchor_chunk(
    points: NDArray[np.float64],
    table: SegmentTable,
    groups: tuple[Fan, ...],
    domains: NDArray[np.float64],
    parameters: Parameters,
    pair_of_fan: dict[int, int],
) -> tuple[NDArray, ...]:
    """The arrays of :class:`Anchors` for some vertices: segment, weight, ratio, side, pair, between, station."""
    count, segments = len(points), len(table.ends)
    t = table.project(points)
    weight = np.zeros((count, segments))
    pair_count = sum(len(fan.segments) - 1 for fan in groups)
    between = np.zeros((count, max(pair_count, 2)))
    along_pair = np.zeros_like(between)
    segment = 0
    for f, fan in enumerate(groups):
        size = len(fan.segments)
        if size == 1:
            weight[:, segment] = domains[:, f]
        else:
            inside = slice(segment, segment + size)
            share = _share_in_fan(points, table, t, inside, parameters)
            weight[:, inside] = domains[:, f, None] * share
            where = slice(pair_of_fan[f], pair_of_fan[f] + size - 1)
            # the product of both weights vanishes at vertices that do not lie between the two segments
            between[:, where] = domains[:, f, None] * 4.0 * share[:, :-1] * share[:, 1:]
            place = np.clip((t[:, inside][:, :-1] + t[:, inside][:, 1:]) / 2.0, 0.0, 1.0)
            along_pair[:, where] = place * (STATIONS - 1)
        segment += size
    best, kept = _strongest(weight)
    pair, pair_kept = _strongest_pairs(between)
    ratio = np.take_along_axis(t, best, axis=1)
    offset = points[:, None] - (table.start[best] + ratio[..., None] * table.along[best])
    side = _side(offset, table.normals[best], np.clip(ratio, 0.0, 1.0))
    stiff = np.array([fan.stiff for fan in groups for _ in fan.segments])[best]
    # at mid-segment on the external side there is no rounding, only the bone's rotation
    ratio, side = np.where(stiff, 0.5, ratio), np.where(stiff, 1.0, side)
    station = np.take_along_axis(along_pair, pair, axis=1)
    return best.astype(np.int32), kept, ratio, side, pair, pair_kept, station


def _side(offset: NDArray[np.float64], normals: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
    """External side (1) or internal (0) by R45's cosine, blended along the segment, shape (V, 4).

    The cosine is evaluated with the normal of each joint, and the results are interpolated: hip and knee bend in
    opposite senses, and half-way along a thigh an interpolated normal would vanish and flip.
    """
    length = np.maximum(np.linalg.norm(offset, axis=2), 1e-12)
    height = np.einsum("vok,voek->voe", offset, normals)
    sides = smoothstep((height / length[..., None] + SIDE_BAND) / (2.0 * SIDE_BAND))
    share = np.stack([1.0 - place, place], axis=2)
    return np.asarray((share * sides).sum(axis=2))


def _share_in_fan(
    points: NDArray[np.float64],
    table: SegmentTable,
    t: NDArray[np.float64],
    inside: slice,
    parameters: Parameters,
) -> NDArray[np.float64]:
    """Weights of side-by-side segments, of which at most two neighbours are not zero, shape (V, segments).

    R_k, the ratio on the virtual segment from segment k to k + 1, is remapped to 0 within the first's proximity and to
    1 within the second's (areas 1-4-7, 2-5-8 and 3-6-9 of A Fig. 7). The sum of all R_k is a continuous segment index:
    between two segments it gives the paper's weights 1 − R and R, and it stays continuous where the nearest segment
    changes and where virtual segments contradict each other.

    Virtual segments of neighbours that begin at the same joint, as in the carpus, connect points at the fan's largest
    ratio: the projections themselves would coincide at that joint, and R would be undefined where other segments are
    still apart.
    """
    start, along, ends = table.start[inside], table.along[inside], table.ends[inside]
    place = np.clip(t[:, inside], 0.0, 1.0)
    farthest = place.max(axis=1, keepdims=True)
    apart = np.linalg.norm(np.diff(start, axis=0), axis=1)
    joined = apart < 1e-3 * np.linalg.norm(along, axis=1).max()
    out = np.zeros_like(place)
    passed = np.zeros(len(points))
    for k in range(len(start) - 1):
        first, second = (farthest[:, 0] if joined[k] else t[:, inside][:, n] for n in (k, k + 1))
        foot = start[k] + first[:, None] * along[k]
        virtual = start[k + 1] + second[:, None] * along[k + 1] - foot
        across = ((points - foot) * virtual).sum(axis=1) / np.maximum((virtual**2).sum(axis=1), 1e-18)
        widths = [
            (1.0 - np.clip(r, 0.0, 1.0)) * parameters.proximity[ends[n, 0], 0]
            + np.clip(r, 0.0, 1.0) * parameters.proximity[ends[n, 1], 1]
            for n, r in ((k, first), (k + 1, second))
        ]
        # some area between the segments is left even with the largest proximities
        room = np.maximum(1.0 - LATERAL * (widths[0] + widths[1]), 0.1)
        passed += np.clip((across - LATERAL * widths[0]) / room, 0.0, 1.0)
    for k in range(len(start)):
        out[:, k] = np.maximum(1.0 - np.abs(passed - k), 0.0)
    return out


def _strongest(weight: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Indices and values of the ``OPERATORS`` largest weights of every row, shape (V, OPERATORS) each.

    The values are continuous: they fade to zero where the next weight would replace them. Ties go to the segments of
    lower index; where five or more weights are equal, nothing can fade, and the first four are kept.
    """
    keep = min(OPERATORS, weight.shape[1])
    order = np.argsort(-_TIES * np.round(weight / _TIES), axis=1, kind="stable")
    largest = np.take_along_axis(weight, order[:, :keep], axis=1)
    rest = np.take_along_axis(weight, order[:, keep : keep + 1], axis=1) if weight.shape[1] > keep else 0.0
    threshold = np.minimum(np.maximum(rest, FLOOR), (1.0 - _ALIKE) * largest[:, :1])
    faded = np.maximum(largest - threshold, 0.0)
    faded /= faded.sum(axis=1, keepdims=True)
    order = order[:, :keep]
    if keep < OPERATORS:
        pad = ((0, 0), (0, OPERATORS - keep))
        order, faded = np.pad(order, pad, mode="edge"), np.pad(faded, pad)
    return order, faded


def _strongest_pairs(between: NDArray[np.float64]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """The two palm pairs of every vertex with the largest weights, less the third largest, shape (V, 2) each."""
    order = np.argsort(-between, axis=1)[:, :2]
    kept = np.take_along_axis(between, order, axis=1)
    third = np.sort(between, axis=1)[:, -3] if between.shape[1] > 2 else np.zeros(len(between))
    return order.astype(np.int32), np.maximum(kept - third[:, None], 0.0)


def smoothstep(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smoothstep: 0 below 0, 1 above 1, x² (3 − 2 x) between, with continuous first derivative."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
