"""Binding: where every vertex lies relative to the segments that carry it (A §4, R34–R48).

Nothing here depends on the pose, and only the placing inside the palm depends on the parameters.
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
"""Segment operators a vertex may hold (the paper has one; the rest make borders soft)."""

STATIONS = 5
"""Places along a pair of neighbouring palm segments where the scale factor λ is evaluated; linear in between."""

# |cosine| below which a vertex is partly external and partly internal: sections near a joint stand upright outside and
# lean inside, and a wider band shears the sides less
SIDE_BAND = 0.75
# share of a proximity that counts across the palm: along a segment there is one at either end, across it one side only;
# what lies in between then shears over a broad strip
LATERAL = 0.6
FLOOR = 2e-2  # weight below which an operator is dropped, faded so that nothing jumps
_ALIKE = 1e-3  # of the largest weight: operators that differ by less from one left out are not faded any further
_TIES = 1e-9  # weights that differ by less, as sums in another order do, are equal


@dataclass(frozen=True, eq=False)
class Anchors:
    """Places of V vertices on up to ``OPERATORS`` segments each.

    Attributes:
        ends: Proximal and distal joint of every segment, shape (S, 2).
        muscle: Whether a segment's internal muscle inflates, shape (S,).
        stiff: Whether all around a segment turns with its bone, as in a skull, shape (S,).
        rest: Vertices at rest [m], shape (V, 3).
        segment: Segments of a vertex, shape (V, 4).
        weight: Their weights, rows summing to one; unused ones are zero, shape (V, 4).
        ratio: Projection on the segment, 0 at the proximal joint, 1 at the distal one, clamped except beyond
            extremities, shape (V, 4) (R37, C1).
        side: 1 on the external side, 0 on the internal, between over a band of R45's cosine, shape (V, 4).
        pairs: Segments of every pair of palm neighbours, shape (N, 2).
        pair: Palm pairs between which a vertex lies, shape (V, 2), and
        between: how much it lies in between, 0 on either segment, 1 in the middle, shape (V, 2) (R44, R49);
        station: where along the pair, 0 … STATIONS − 1, shape (V, 2).
        rigid: Joint that a vertex without flesh follows with its bone, -1 for all others, shape (V,). Such a vertex has
            no weight on any segment.
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
    """Place vertices on the segments of their domains.

    Args:
        vertices: Rest positions [m], shape (V, 3).
        skeleton: The rest skeleton.
        groups: Operators, from :func:`~warpjld.covering.operators.fans`.
        domains: Weight of every fan, shape (V, fans).
        parameters: Their proximities set how wide the palm's in-between areas are (A Fig. 7).
        rigid: Joint that a vertex follows rigidly, -1 for flesh, shape (V,); all is flesh by default.
        chunk: Vertices placed at a time, which bounds memory.
    """
    ends = segment_ends(groups)
    table = SegmentTable.build(skeleton, ends)
    pairs, pair_of_fan = _neighbour_pairs(groups)
    rows = [
        _anchor_some(vertices[i : i + chunk], table, groups, domains[i : i + chunk], parameters, pair_of_fan)
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
    """All pairs of neighbours, and the number of each fan's first pair."""
    pairs: list[tuple[int, int]] = []
    first: dict[int, int] = {}
    segment = 0
    for f, fan in enumerate(groups):
        first[f] = len(pairs)
        pairs.extend((segment + k, segment + k + 1) for k in range(len(fan.segments) - 1))
        segment += len(fan.segments)
    return np.array(pairs, dtype=np.int32).reshape(-1, 2), first


def _anchor_some(
    points: NDArray[np.float64],
    table: SegmentTable,
    groups: tuple[Fan, ...],
    domains: NDArray[np.float64],
    parameters: Parameters,
    pair_of_fan: dict[int, int],
) -> tuple[NDArray, ...]:
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
            # weights of both neighbours make the product vanish wherever the pair is not the vertex's own
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
    # half-way along and outside nothing rounds: there, all turns with the bone
    ratio, side = np.where(stiff, 0.5, ratio), np.where(stiff, 1.0, side)
    station = np.take_along_axis(along_pair, pair, axis=1)
    return best.astype(np.int32), kept, ratio, side, pair, pair_kept, station


def _side(offset: NDArray[np.float64], normals: NDArray[np.float64], place: NDArray[np.float64]) -> NDArray[np.float64]:
    """External side (1) or internal (0) by R45's cosine, blended along the segment.

    Judged with the normals of both joints one by one: hip and knee bend in opposite senses, and half-way along a thigh
    an interpolated normal would vanish and turn over.
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
    """Weights of side-by-side segments, of which at most two neighbours hold a vertex, shape (V, segments).

    R_k, the ratio on the virtual segment from segment k to k + 1, is remapped to 0 within the first's proximity and to
    1 within the second's (areas 1-4-7, 2-5-8 and 3-6-9 of A Fig. 7). The sum of all R counts the neighbours passed:
    between two of them it gives the paper's 1 − R and R, and it stays continuous where the nearest segment changes and
    where the virtual segments contradict each other.

    Virtual segments of neighbours that begin at one joint, as in the carpus, join points at the fan's largest ratio:
    the projections themselves would fall together at that joint and R lose its sense while other segments still differ.
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
        # an in-between area is left even where proximities are as large as can be
        room = np.maximum(1.0 - LATERAL * (widths[0] + widths[1]), 0.1)
        passed += np.clip((across - LATERAL * widths[0]) / room, 0.0, 1.0)
    for k in range(len(start)):
        out[:, k] = np.maximum(1.0 - np.abs(passed - k), 0.0)
    return out


def _strongest(weight: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The ``OPERATORS`` largest weights of every row, faded to zero where another would take their place.

    Equal ones go to the first segments; where five and more share a vertex alike, nothing can fade, and the first four
    share it.
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
    order = np.argsort(-between, axis=1)[:, :2]
    kept = np.take_along_axis(between, order, axis=1)
    third = np.sort(between, axis=1)[:, -3] if between.shape[1] > 2 else np.zeros(len(between))
    return order.astype(np.int32), np.maximum(kept - third[:, None], 0.0)


def smoothstep(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """0 below 0, 1 above 1, x² (3 − 2 x) between: without an edge at either."""
    x = np.clip(x, 0.0, 1.0)
    return np.asarray(x * x * (3.0 - 2.0 * x))
