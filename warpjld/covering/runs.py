"""Packing anchors into runs: vertices sorted by the joints and rotations they use, so that tiles need no gathers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import OPERATORS, STATIONS, Anchors
from warpjld.covering.drivers import Drivers
from warpjld.covering.parameters import Parameters

__all__ = ["Columns", "Runs", "pack_runs", "palette"]


@dataclass(frozen=True)
class Columns:
    """Where each input begins in a row of the palette."""

    joints: int
    segments: int
    pairs: int

    @property
    def halfway(self) -> int:
        return 3 * self.joints

    @property
    def rotations(self) -> int:
        return 7 * self.joints

    @property
    def flexion_ratio(self) -> int:
        return 11 * self.joints

    @property
    def palm(self) -> int:
        return 12 * self.joints

    @property
    def muscles(self) -> int:
        return self.palm + STATIONS * self.pairs

    @property
    def width(self) -> int:
        return self.muscles + self.segments


@dataclass(frozen=True, eq=False)
class Runs:
    """Arguments of ``warpjld_kernels.covering_tiles.deform_runs`` that do not depend on the pose."""

    columns: Columns
    tiles: NDArray[np.int32]
    runs: NDArray[np.int32]
    slots: NDArray[np.int32]
    coefficients: NDArray[np.float32]
    order: NDArray[np.int32]


def palette(columns: Columns, anchors: Anchors, parameters: Parameters, drivers: Drivers) -> NDArray[np.float32]:
    """Inputs of a frame in one row, shape (F, columns.width)."""
    frames = len(drivers.positions)
    out = np.empty((frames, columns.width), dtype=np.float32)
    out[:, : columns.halfway] = drivers.positions.reshape(frames, -1)
    out[:, columns.halfway : columns.rotations] = drivers.halfway.reshape(frames, -1)
    out[:, columns.rotations : columns.flexion_ratio] = drivers.rotations.reshape(frames, -1)
    out[:, columns.flexion_ratio : columns.palm] = drivers.flexion_ratio
    if columns.pairs:
        joints = anchors.ends[anchors.pairs, 0]
        exponent = parameters.palm[joints].mean(axis=1)
        out[:, columns.palm : columns.muscles] = np.expm1(-exponent[:, None] * drivers.closing).reshape(frames, -1)
    ratio = drivers.flexion_ratio
    out[:, columns.muscles :] = 0.5 * (ratio[:, anchors.ends[:, 0]] + ratio[:, anchors.ends[:, 1]])
    return out


def pack_runs(
    anchors: Anchors,
    offset: NDArray[np.float32],
    rotation: NDArray[np.float32],
    rounding: NDArray[np.float32],
    muscle: NDArray[np.float32],
    joints: int,
    lanes: int,
) -> Runs:
    """Sort vertices into runs of at least ``lanes`` and lay their coefficients out row by row.

    Args:
        anchors: Places of V vertices.
        offset: Rest offsets, shape (V, 3).
        rotation: Weights of the three rotations of every operator, shape (V, 4, 3).
        rounding: Roundings of the two joints of every operator, shape (V, 4, 2).
        muscle: Muscle of every operator, shape (V, 4, 3).
        joints: J of the skeleton.
        lanes: Vertices in a tile.
    """
    columns = Columns(joints, len(anchors.ends), len(anchors.pairs))
    members, segment_sets, pair_sets = _group(anchors, lanes)
    tiles, runs, slots, coefficients = [], [], [], []
    first_lane = first_coefficient = first_slot = 0
    for r, vertices in enumerate(members):
        rows, run_slots, counts = _fill(
            anchors, columns, vertices, segment_sets[r], pair_sets[r], offset, rotation, rounding, muscle
        )
        length = len(vertices)
        runs.append((first_lane, length, first_coefficient, first_slot, *counts))
        tiles += [(r, min(lane, length - lanes)) for lane in range(0, length, lanes)]
        slots += run_slots
        coefficients.append(rows.ravel())
        first_lane += length
        first_coefficient += rows.size
        first_slot += len(run_slots)
    return Runs(
        columns,
        np.array(tiles, dtype=np.int32),
        np.array(runs, dtype=np.int32),
        np.array(slots, dtype=np.int32),
        np.concatenate(coefficients).astype(np.float32),
        np.concatenate(members).astype(np.int32),
    )


def _group(anchors: Anchors, lanes: int) -> tuple[list[NDArray[np.int64]], list[frozenset[int]], list[frozenset[int]]]:
    """Vertices by the set of segments and palm pairs they use; sets with too few vertices join a similar one."""
    used = np.where(anchors.weight > 0.0, anchors.segment, -1)
    between = np.where(anchors.between > 0.0, anchors.pair, -1)
    key = np.concatenate([np.sort(used, axis=1), np.sort(between, axis=1)], axis=1)
    distinct, member = np.unique(key, axis=0, return_inverse=True)
    by_group = np.split(np.argsort(member, kind="stable"), np.cumsum(np.bincount(member))[:-1])
    groups = [
        (frozenset(row[:OPERATORS]) - {-1}, frozenset(row[OPERATORS:]) - {-1}, [vertices])
        for row, vertices in zip(distinct.tolist(), by_group, strict=True)
    ]
    sizes = [len(g[2][0]) for g in groups]
    while len(groups) > 1 and min(sizes) < lanes:
        small = sizes.index(min(sizes))
        segments, pairs, vertices = groups.pop(small)
        size = sizes.pop(small)
        grown = [
            (len(segments | g[0]) - len(g[0])) * n + (len(segments | g[0]) - len(segments)) * size
            for g, n in zip(groups, sizes, strict=True)
        ]
        near = grown.index(min(grown))
        groups[near] = (groups[near][0] | segments, groups[near][1] | pairs, groups[near][2] + vertices)
        sizes[near] += size
    members = [np.concatenate(g[2]) for g in groups]
    if sizes[0] < lanes:  # a surface smaller than one tile: the last vertex stands in for the missing ones
        members[0] = np.concatenate([members[0], np.repeat(members[0][-1:], lanes - sizes[0])])
    return members, [g[0] for g in groups], [g[1] for g in groups]


def _fill(
    anchors: Anchors,
    columns: Columns,
    vertices: NDArray[np.int64],
    segments: frozenset[int],
    pairs: frozenset[int],
    offset: NDArray[np.float32],
    rotation: NDArray[np.float32],
    rounding: NDArray[np.float32],
    muscle: NDArray[np.float32],
) -> tuple[NDArray[np.float64], list[int], tuple[int, int, int, int]]:
    """Coefficient rows of one run, the palette columns they multiply, and how many there are of each kind."""
    lanes = np.arange(len(vertices))
    joint, turn, scale, swell = (_Rows(len(vertices)) for _ in range(4))
    for k in range(OPERATORS):
        for s in segments:
            here = lanes[(anchors.segment[vertices, k] == s) & (anchors.weight[vertices, k] > 0.0)]
            if not here.size:
                continue
            v = vertices[here]
            p, d = (int(j) for j in anchors.ends[s])
            weight, ratio = anchors.weight[v, k], anchors.ratio[v, k]
            joint.add(3 * p, here, weight * (1.0 - ratio))
            joint.add(3 * d, here, weight * ratio)
            for column, c in (
                (columns.halfway + 4 * p, 0),
                (columns.rotations + 4 * p, 1),
                (columns.halfway + 4 * d, 2),
            ):
                turn.add(column, here, rotation[v, k, c])
            for j, end in ((p, 0), (d, 1)):
                scale.add(columns.flexion_ratio + j, here, rounding[v, k, end])
            swell.add(columns.muscles + s, here, muscle[v, k])
    for k in range(2):
        for n in pairs:
            here = lanes[(anchors.pair[vertices, k] == n) & (anchors.between[vertices, k] > 0.0)]
            v = vertices[here]
            low = np.minimum(anchors.station[v, k].astype(int), STATIONS - 2)
            part = anchors.station[v, k] - low
            for station in range(STATIONS):
                amount = np.where(low == station, 1.0 - part, 0.0) + np.where(low + 1 == station, part, 0.0)
                scale.add(columns.palm + STATIONS * n + station, here, anchors.between[v, k] * amount)
    kinds = [joint, turn, scale, swell]
    rows = [r for kind in kinds[:3] for r in kind.rows()]
    rows += list(offset[vertices].T.astype(np.float64))
    rows += [r for block in swell.rows() for r in block.T]
    counts = tuple(len(kind.columns()) for kind in kinds)
    return np.array(rows), [c for kind in kinds for c in kind.columns()], counts  # type: ignore[return-value]


class _Rows:
    """Rows of coefficients by palette column; a row that stays zero is dropped."""

    def __init__(self, lanes: int) -> None:
        self._lanes = lanes
        self._rows: dict[int, NDArray[np.float64]] = {}

    def add(self, column: int, lanes: NDArray[np.int64], values: NDArray) -> None:
        if values.any():
            row = self._rows.setdefault(column, np.zeros((self._lanes, *values.shape[1:])))
            row[lanes] += values

    def columns(self) -> list[int]:
        return sorted(self._rows)

    def rows(self) -> list[NDArray[np.float64]]:
        return [self._rows[c] for c in self.columns()]
