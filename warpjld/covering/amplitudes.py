"""Derivatives of the deformed surface by the inflation and muscle amplitudes, in which it is linear.

Coefficient fields, projections and rotations do not depend on the amplitudes a, so the covering formula
(``fields.py``) is

    S'(a) = S'(a₀) + Σ_p (a_p − a₀_p) D_p,   D_p = FR g_p rot(q, d) of a rounding, f m_p rot(q, h) of a muscle

with one sparse direction D_p for each amplitude: fitting them needs no diffusion, no packing and no kernel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.covering import Covering
from warpjld.covering.drivers import drive, initial_ratio
from warpjld.covering.parameters import Parameters
from warpjld.covering.rows import scalar_inputs
from warpjld.covering.segment_table import SegmentTable
from warpjld.geometry.rotations import rotate, unit
from warpjld.skeleton.kinematics import Poses

__all__ = ["Frame", "LinearDeformation", "amplitudes_of", "with_amplitudes"]

_STILL = 1e-6  # flexion ratio below which a joint counts as straight: floating-point error reaches this size


def amplitudes_of(parameters: Parameters) -> NDArray[np.float64]:
    """Inflation amplitudes of J joints, then muscle amplitudes by the joint where the segment begins, shape (2 J,)."""
    return np.concatenate([parameters.inflation, parameters.muscle])


def with_amplitudes(parameters: Parameters, amplitudes: NDArray[np.float64]) -> Parameters:
    """The same parameters with other amplitudes, shape (2 J,)."""
    inflation, muscle = np.split(np.asarray(amplitudes, dtype=np.float64), 2)
    return replace(parameters, inflation=inflation, muscle=muscle)


@dataclass(frozen=True, eq=False)
class Frame:
    """The deformed surface in one pose, and its derivatives by the amplitudes.

    Attributes:
        number: Index of the pose.
        points: S'(a₀) [m], shape (V, 3).
        moved: Vertices that depend on the amplitudes in this pose, shape (n,).
        directions: Derivatives D of their positions [m], shape (3 n, 2 J); rows are x, y, z of each vertex.
        ratio: Absolute difference of the joints' flexion ratios from those at rest, shape (J,).
    """

    number: int
    points: NDArray[np.float32]
    moved: NDArray[np.int64]
    directions: sp.csr_array
    ratio: NDArray[np.float64]


class LinearDeformation:
    """A covering over F poses as a function of its 2 J amplitudes; all its other parameters stay fixed.

    Args:
        covering: A bound surface.
        poses: F poses of its skeleton.

    Raises:
        InputError: Poses of another skeleton, or not finite.
    """

    def __init__(self, covering: Covering, poses: Poses) -> None:
        covering.check(poses)
        self.covering, self.poses = covering, poses
        anchors, fields, skeleton = covering.anchors, covering.fields, covering.skeleton
        self.amplitudes = amplitudes_of(covering.parameters)
        self._drivers = drive(skeleton, anchors, poses)
        joints, initial = len(skeleton), initial_ratio(skeleton)
        scalars = scalar_inputs(anchors, covering.parameters, self._drivers)
        # the offsets in use are those of straight joints (``rows_of``): to first order, the inflation at rest is
        # subtracted from that of every pose
        scalars[:, :joints] -= initial
        scalars[:, joints + fields.palm.shape[1] :] -= 0.5 * initial[anchors.ends].sum(axis=1)
        self._ratio, self._driven = scalars[:, :joints].copy(), scalars[:, joints + fields.palm.shape[1] :].copy()
        for driven in (self._ratio, self._driven):
            driven[np.abs(driven) < _STILL] = 0.0
        self._offset = fields.offsets(anchors.rest, skeleton.rest)
        self._roundings, self._muscles = fields.roundings.tocsc(), fields.muscles.tocsc()
        table = SegmentTable.build(skeleton, anchors.ends)
        segment = np.repeat(np.arange(len(anchors.ends)), np.diff(self._muscles.indptr))
        self._heights = table.heights(anchors.rest[self._muscles.indices], segment)

    def __len__(self) -> int:
        return len(self._ratio)

    def frames(self, block: int = 16) -> Iterator[Frame]:
        """All poses in order, deformed ``block`` at a time."""
        for start, points in self.covering.blocks(self.poses, frames=block):
            for k, surface in enumerate(points):
                yield self._frame(start + k, surface.copy())

    def _frame(self, number: int, points: NDArray[np.float32]) -> Frame:
        """The pose of an index with its surface (V, 3), and the derivatives D of the vertices that amplitudes move."""
        fields, drivers, joints = self.covering.fields, self._drivers, len(self.covering.skeleton)
        round_row, round_column, round_value, _ = _scaled(self._roundings, self._ratio[number])
        muscle_row, segment, muscle_value, entry = _scaled(self._muscles, self._driven[number])
        moved, place = np.unique(np.concatenate([round_row, muscle_row]), return_inverse=True)
        turns = np.concatenate([drivers.halfway[number], drivers.rotations[number]])
        turn = unit(fields.turns[moved] @ turns)
        first = place[: len(round_row)]
        value = np.concatenate(
            [
                round_value[:, None] * rotate(turn, self._offset[moved])[first],
                muscle_value[:, None] * rotate(turn[place[len(round_row) :]], self._heights[entry]),
            ]
        )
        column = np.concatenate([round_column, joints + self.covering.anchors.ends[segment, 0]])
        rows = 3 * place[:, None] + np.arange(3)
        shape = (3 * len(moved), 2 * joints)
        directions = sp.coo_array((value.ravel(), (rows.ravel(), np.repeat(column, 3))), shape=shape).tocsr()
        return Frame(number, points, moved, directions, np.abs(self._ratio[number]))


def _scaled(
    fields: sp.csc_array, by: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Entries of the columns whose factor is not zero: row, column, value × factor, and index into ``fields.data``.

    Args:
        fields: Coefficients, shape (V, columns).
        by: Factor of every column, shape (columns,).
    """
    columns = np.flatnonzero(by)
    length = np.diff(fields.indptr)[columns]
    before = np.cumsum(length) - length
    entry = np.arange(length.sum()) + np.repeat(fields.indptr[columns] - before, length)
    column = np.repeat(columns, length)
    return fields.indices[entry].astype(np.int64), column, fields.data[entry] * by[column], entry
