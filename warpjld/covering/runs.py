"""Packing anchors into runs: vertices sorted by the joints and rotations they use, so that lanes need no gathers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.covering.drivers import Drivers
from warpjld.covering.grouping import group
from warpjld.covering.parameters import Parameters

__all__ = ["Columns", "Runs", "pack", "pack_runs", "palette"]


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
    def kinds(self) -> tuple[int, ...]:
        """Where joints, rotations, scales and muscles begin, and where they end."""
        return 0, self.halfway, self.flexion_ratio, self.muscles, self.width

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
    return pack(scalar, swelling, offset, columns, lanes)


def pack(
    scalar: sp.csr_array,
    swelling: list[sp.csr_array],
    offset: NDArray[np.float32],
    columns: Columns,
    lanes: int,
) -> Runs:
    """Sort vertices into runs of at least ``lanes`` and lay their coefficients out row by row.

    Args:
        scalar: Coefficients of joints, rotations and scales, shape (V, columns.width).
        swelling: Muscle vectors, x, y and z apart, likewise.
        offset: Rest offsets, shape (V, 3).
        columns: Of the palette.
        lanes: Vertices in a tile.
    """
    used = abs(scalar) + abs(swelling[0]) + abs(swelling[1]) + abs(swelling[2])
    used.eliminate_zeros()
    price = np.repeat([3.0, 4.0, 1.0, 3.0], np.diff(columns.kinds))
    members, read = group(used, price, lanes)
    order, length = np.concatenate(members), np.array([len(m) for m in members])
    count, muscle = len(members), columns.muscles
    run, slot = np.repeat(np.arange(count), [len(c) for c in read]), np.concatenate(read)
    kind = np.searchsorted(columns.kinds, slot, side="right") - 1
    slots_of = np.zeros((count, 4), dtype=np.int64)
    np.add.at(slots_of, (run, kind), 1)
    # a run holds one row of its length for every slot, but three for offsets and three for a muscle
    high = slots_of @ [1, 1, 1, 3] + 3
    first_slot, first_lane = _starts(slots_of.sum(axis=1)), _starts(length)
    first_coefficient = _starts(high * length)
    row = np.full((count, columns.width), -1, dtype=np.int64)
    place = np.arange(len(slot)) - first_slot[run]
    plain = slots_of[:, :3].sum(axis=1)[run]
    row[run, slot] = np.where(slot < muscle, place, plain + 3 + 3 * (place - plain))
    run_of, lane_of = np.repeat(np.arange(count), length), np.arange(len(order)) - np.repeat(first_lane, length)
    coefficients = np.zeros(int((high * length).sum()), dtype=np.float32)

    def lay(at: NDArray[np.int64], rows: NDArray[np.int64], values: NDArray) -> None:
        r = run_of[at]
        coefficients[first_coefficient[r] + rows * length[r] + lane_of[at]] = values

    for axis, matrix in enumerate((scalar, *swelling)):
        some = matrix[order].tocoo()
        stored = some.data != 0.0
        at, column = some.row[stored], some.col[stored]
        lay(at, row[run_of[at], column] + max(axis - 1, 0), some.data[stored])
    everyone = np.arange(len(order))
    for axis in range(3):
        lay(everyone, slots_of[:, :3].sum(axis=1)[run_of] + axis, offset[order, axis])
    tiles = [(r, min(lane, n - lanes)) for r, n in enumerate(length.tolist()) for lane in range(0, n, lanes)]
    table = np.column_stack([first_lane, length, first_coefficient, first_slot, slots_of])
    return Runs(
        columns,
        np.array(tiles, dtype=np.int32),
        table.astype(np.int32),
        slot.astype(np.int32),
        coefficients,
        order.astype(np.int32),
    )


def _starts(lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.cumsum(lengths) - lengths


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
