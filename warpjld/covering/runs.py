"""Packing anchors into runs: vertices sorted by the joints and rotations they use, so that lanes need no gathers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.covering.drivers import Drivers
from warpjld.covering.parameters import Parameters

__all__ = ["Columns", "Runs", "pack_runs", "palette"]


@dataclass(frozen=True)
class Columns:
    """Where each input begins in a row of the palette; places of the joints come first.

    Attributes:
        joints: J of the skeleton.
        segments: Of the operators.
        pairs: Neighbours in palms.
    """

    joints: int
    segments: int
    pairs: int

    @property
    def halfway(self) -> int:
        """Rotations halfway between the two bones at a joint."""
        return 3 * self.joints

    @property
    def rotations(self) -> int:
        """Rotations of the bones."""
        return 7 * self.joints

    @property
    def flexion_ratio(self) -> int:
        """Flexion ratios of the joints (R59)."""
        return 11 * self.joints

    @property
    def palm(self) -> int:
        """Thickening of the palm at the stations of every pair (C3)."""
        return 12 * self.joints

    @property
    def muscles(self) -> int:
        """Flexion ratios that inflate the segments' muscles."""
        return self.palm + STATIONS * self.pairs

    @property
    def width(self) -> int:
        """Numbers in a row."""
        return self.muscles + self.segments


@dataclass(frozen=True, eq=False)
class Runs:
    """Arguments of ``warpjld_kernels.covering_runs.deform_runs`` that do not depend on the pose.

    Attributes:
        columns: Of the palette.
        tiles: Run and first lane in it of every tile, shape (tiles, 2).
        runs: Of every run its first lane, its vertices, its first coefficient, its first slot, and how many slots are
            joints, rotations, scales and muscles, shape (runs, 8).
        slots: Palette columns that the runs read, run by run.
        coefficients: Rows of a run's slots one after another, a muscle's three, then offsets; a column a vertex.
        order: Vertex at every lane, those of the runs one after another.
    """

    columns: Columns
    tiles: NDArray[np.int32]
    runs: NDArray[np.int32]
    slots: NDArray[np.int32]
    coefficients: NDArray[np.float32]
    order: NDArray[np.int32]

    def lanes(self) -> NDArray[np.int32]:
        """Tiles of a single vertex, for devices whose threads take one each."""
        length = self.runs[:, 1]
        run = np.repeat(np.arange(len(length)), length)
        lane = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        return np.column_stack([run, lane]).astype(np.int32)


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
    scalar = _scalar_coefficients(anchors, columns, rotation, rounding)
    swelling = [_muscle_coefficients(anchors, columns, muscle[..., axis]) for axis in range(3)]
    members, masks = _group(scalar + abs(swelling[0]) + abs(swelling[1]) + abs(swelling[2]), columns, lanes)
    starts = (0, columns.halfway, columns.flexion_ratio, columns.muscles, columns.width)
    tiles, runs, slots, coefficients = [], [], [], []
    first_lane = first_coefficient = first_slot = 0
    for r, (vertices, mask) in enumerate(zip(members, masks, strict=True)):
        kinds = [[c for c in mask if low <= c < high] for low, high in pairwise(starts)]
        plain = [c for kind in kinds[:3] for c in kind]
        rows = [scalar[vertices][:, plain].toarray().T, offset[vertices].T]
        swell = np.stack([m[vertices][:, kinds[3]].toarray().T for m in swelling], axis=1)
        rows.append(swell.reshape(-1, len(vertices)))
        block = np.concatenate(rows)
        runs.append((first_lane, len(vertices), first_coefficient, first_slot, *(len(kind) for kind in kinds)))
        tiles += [(r, min(lane, len(vertices) - lanes)) for lane in range(0, len(vertices), lanes)]
        slots += plain + kinds[3]
        coefficients.append(block.ravel())
        first_lane += len(vertices)
        first_coefficient += block.size
        first_slot += len(mask)
    return Runs(
        columns,
        np.array(tiles, dtype=np.int32),
        np.array(runs, dtype=np.int32),
        np.array(slots, dtype=np.int32),
        np.concatenate(coefficients).astype(np.float32),
        np.concatenate(members).astype(np.int32),
    )


def _scalar_coefficients(
    anchors: Anchors, columns: Columns, rotation: NDArray[np.float32], rounding: NDArray[np.float32]
) -> sp.csr_array:
    """Coefficients of joints, rotations and scales by palette column, shape (V, columns.width)."""
    proximal, distal = anchors.ends[anchors.segment, 0], anchors.ends[anchors.segment, 1]
    entries: list[tuple[NDArray, NDArray]] = [
        (3 * proximal, anchors.weight * (1.0 - anchors.ratio)),
        (3 * distal, anchors.weight * anchors.ratio),
        (columns.halfway + 4 * proximal, rotation[..., 0]),
        (columns.rotations + 4 * proximal, rotation[..., 1]),
        (columns.halfway + 4 * distal, rotation[..., 2]),
        (columns.flexion_ratio + proximal, rounding[..., 0]),
        (columns.flexion_ratio + distal, rounding[..., 1]),
    ]
    hard = (anchors.rigid >= 0).astype(np.float64)[:, None]
    joint = np.maximum(anchors.rigid, 0)[:, None]
    entries += [(3 * joint, hard), (columns.rotations + 4 * joint, hard)]
    if columns.pairs:
        low = np.minimum(anchors.station.astype(int), STATIONS - 2)
        part = anchors.station - low
        first = columns.palm + STATIONS * anchors.pair + low
        entries += [(first, anchors.between * (1.0 - part)), (first + 1, anchors.between * part)]
    return _sparse(entries, len(anchors), columns.width)


def _muscle_coefficients(anchors: Anchors, columns: Columns, muscle: NDArray[np.float32]) -> sp.csr_array:
    return _sparse([(columns.muscles + anchors.segment, muscle)], len(anchors), columns.width)


def _sparse(entries: list[tuple[NDArray, NDArray]], rows: int, width: int) -> sp.csr_array:
    row = np.concatenate([np.repeat(np.arange(rows), c.shape[1]) for c, _ in entries])
    column = np.concatenate([c.ravel() for c, _ in entries])
    value = np.concatenate([v.ravel() for _, v in entries]).astype(np.float64)
    kept = value != 0.0
    out = sp.coo_array((value[kept], (row[kept], column[kept])), shape=(rows, width)).tocsr()
    out.sum_duplicates()
    return out


def _group(used: sp.csr_array, columns: Columns, lanes: int) -> tuple[list[NDArray[np.int64]], list[list[int]]]:
    """Vertices by the palette columns they use; groups join where that costs less than tiles that are partly filled."""
    signature = np.random.default_rng(0).integers(1, 2**62, used.shape[1])
    pattern = sp.csr_array((np.ones(used.nnz, dtype=np.int64), used.indices, used.indptr), shape=used.shape)
    _, first, member = np.unique(pattern @ signature, return_index=True, return_inverse=True)
    members = np.split(np.argsort(member, kind="stable"), np.cumsum(np.bincount(member))[:-1])
    masks = [sum(1 << int(c) for c in used.indices[used.indptr[v] : used.indptr[v + 1]]) for v in first]
    sizes = [len(m) for m in members]
    cost = _column_cost(columns)

    def work(size: int, mask: int) -> int:
        return -(-size // lanes) * (_FIXED + cost(mask))

    settled = 0  # groups at the front that are better left alone
    while len(masks) - settled > 0 and len(masks) > 1:
        small = min(range(settled, len(sizes)), key=sizes.__getitem__)
        mask, vertices, size = masks.pop(small), members.pop(small), sizes.pop(small)
        added = [work(n + size, m | mask) - work(n, m) for m, n in zip(masks, sizes, strict=True)]
        near = min(range(len(added)), key=added.__getitem__)
        if size >= lanes and added[near] >= work(size, mask):
            masks.insert(0, mask)
            members.insert(0, vertices)
            sizes.insert(0, size)
            settled += 1
            continue
        masks[near] |= mask
        members[near] = np.concatenate([members[near], vertices])
        sizes[near] += size
    if sizes[0] < lanes:  # a surface smaller than one tile: its last vertex stands in for the missing ones
        members[0] = np.concatenate([members[0], np.repeat(members[0][-1:], lanes - sizes[0])])
    return members, [[c for c in range(m.bit_length()) if m >> c & 1] for m in masks]


_FIXED = 60  # multiply-adds a vertex spends whatever its columns, mostly on rotating


def _column_cost(columns: Columns) -> Callable[[int], int]:
    """Multiply-adds a vertex spends on a set of palette columns."""
    joints, turns = (1 << columns.halfway) - 1, (1 << columns.flexion_ratio) - (1 << columns.halfway)
    scales = (1 << columns.muscles) - (1 << columns.flexion_ratio)

    def cost(mask: int) -> int:
        return (
            3 * (mask & joints).bit_count()
            + 4 * (mask & turns).bit_count()
            + (mask & scales).bit_count()
            + 3 * (mask >> columns.muscles).bit_count()
        )

    return cost
