"""Packing of coefficients into runs: vertices that use the same pose inputs, computed in lanes without gathers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.covering.drivers import Drivers
from warpjld.covering.grouping import group
from warpjld.covering.parameters import Parameters
from warpjld.covering.rows import Rows, scalar_inputs
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Columns", "Runs", "pack", "pack_runs", "palette"]


@dataclass(frozen=True)
class Columns:
    """Layout of the palette, a row of all pose inputs of a frame: the first column of each kind, positions first.

    Attributes:
        joints: Number of joints, J.
        segments: Number of segments of the operators, S.
        pairs: Number of pairs of palm neighbours, N.
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
        """First columns of positions, rotations, scales and muscles, and the end of the last."""
        return 0, self.halfway, self.flexion_ratio, self.muscles, self.width

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.muscles + self.segments


@dataclass(frozen=True, eq=False)
class Runs:
    """Arguments of ``warpjld_kernels.covering_runs.deform_runs`` that do not depend on the pose.

    Attributes:
        columns: Layout of the palette.
        tiles: Run, and first lane within it, of every tile, shape (tiles, 2).
        runs: First lane, number of vertices, first coefficient, first slot, and numbers of slots that are positions,
            rotations, scales and muscles, of every run, shape (runs, 8).
        slots: Palette columns that the runs read, run by run.
        coefficients: For every run a row for each slot but the muscles', three rows of offsets, and three for each
            muscle, with a column for each vertex.
        order: Vertex of every lane, run by run.
    """

    columns: Columns
    tiles: NDArray[np.int32]
    runs: NDArray[np.int32]
    slots: NDArray[np.int32]
    coefficients: NDArray[np.float32]
    order: NDArray[np.int32]

    def lanes(self) -> NDArray[np.int32]:
        """Tiles of a single vertex, for GPUs, where a thread computes one vertex, shape (lanes, 2)."""
        length = self.runs[:, 1]
        run = np.repeat(np.arange(len(length)), length)
        lane = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
        return np.column_stack([run, lane]).astype(np.int32)


def palette(columns: Columns, anchors: Anchors, parameters: Parameters, drivers: Drivers) -> NDArray[np.float32]:
    """All pose inputs, one row per frame, shape (F, columns.width)."""
    frames = len(drivers.positions)
    out = np.empty((frames, columns.width), dtype=np.float32)
    out[:, : columns.halfway] = drivers.positions.reshape(frames, -1)
    out[:, columns.halfway : columns.rotations] = drivers.halfway.reshape(frames, -1)
    out[:, columns.rotations : columns.flexion_ratio] = drivers.rotations.reshape(frames, -1)
    out[:, columns.flexion_ratio :] = scalar_inputs(anchors, parameters, drivers)
    return out


def pack_runs(rows: Rows, columns: Columns, lanes: int) -> Runs:
    """Pack rows of coefficients into runs of at least ``lanes`` vertices."""
    place = columns.muscles + np.arange(columns.segments)
    swelling = [_placed(rows.muscles, place, columns.width, rows.heights[:, axis]) for axis in range(3)]
    return pack(_by_palette(rows, columns), swelling, rows.offset.astype(np.float32), columns, lanes)


def pack(
    scalar: sp.csr_array,
    swelling: list[sp.csr_array],
    offset: NDArray[np.float32],
    columns: Columns,
    lanes: int,
) -> Runs:
    """Sort vertices into runs of at least ``lanes`` and lay their coefficients out row by row.

    Args:
        scalar: Coefficients of positions, rotations and scales, by the first palette column of their input, shape
            (V, columns.width).
        swelling: x, y and z components of the muscle vectors [m], likewise.
        offset: Rest offsets [m], shape (V, 3).
        columns: Layout of the palette.
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
    # rows of coefficients of a run: one for every slot, but three for a muscle, and three for offsets
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
        entries = matrix[order].tocoo()
        stored = entries.data != 0.0
        at, column = entries.row[stored], entries.col[stored]
        lay(at, row[run_of[at], column] + max(axis - 1, 0), entries.data[stored])
    all_lanes = np.arange(len(order))
    for axis in range(3):
        lay(all_lanes, slots_of[:, :3].sum(axis=1)[run_of] + axis, offset[order, axis])
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
    """Start of every block of a concatenation, from the blocks' lengths."""
    return np.cumsum(lengths) - lengths


def _by_palette(rows: Rows, columns: Columns) -> sp.csr_array:
    """Coefficients of positions, rotations and scales by the first palette column of their input, shape (V, width)."""
    joints = columns.joints
    parts = (
        (rows.positions, 3 * np.arange(joints)),
        (rows.turns, columns.halfway + 4 * np.arange(2 * joints)),
        (rows.scales, columns.flexion_ratio + np.arange(columns.muscles - columns.flexion_ratio)),
    )
    total = sp.csr_array((rows.positions.shape[0], columns.width))
    for matrix, place in parts:
        total = total + _placed(matrix, place, columns.width, None)
    return sp.csr_array(total)


def _placed(
    matrix: sp.csr_array, place: NDArray[np.integer], width: int, factor: NDArray[np.float64] | None
) -> sp.csr_array:
    """A matrix of a larger width with column k moved to ``place[k]``, and entries multiplied by ``factor``."""
    values = matrix.data.copy() if factor is None else matrix.data * factor
    # copies, since the calls below change arrays in place
    out = sp.csr_array((values, place[matrix.indices], matrix.indptr.copy()), shape=(matrix.shape[0], width))
    out.eliminate_zeros()
    out.sort_indices()
    return out
