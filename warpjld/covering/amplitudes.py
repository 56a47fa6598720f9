"""The deformation as a linear function of the amplitudes of roundings and muscles.

Coefficient fields, places and rotations do not depend on the amplitudes a, so the covering formula (``fields.py``) is

    S'(a) = B + Σ_p a_p D_p,   D_p = FR g_p rot(q, d)  of a joint's rounding,   f m_p rot(q, h)  of a muscle

with one sparse direction D_p a parameter: fitting amplitudes takes no diffusion, no packing and no kernel.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from warpjld.covering.covering import Covering
from warpjld.covering.drivers import drive
from warpjld.covering.parameters import Parameters
from warpjld.covering.rows import scalar_inputs
from warpjld.covering.segment_table import SegmentTable
from warpjld.rotations import rotate, unit
from warpjld.skeleton.kinematics import Poses

__all__ = ["LinearDeformation", "amplitudes_of", "with_amplitudes"]

_STILL = 1e-6  # flexion ratio below which a joint does not bend: rounding leaves as much


def amplitudes_of(parameters: Parameters) -> NDArray[np.float64]:
    """Inflation of J joints, then muscle of those where segments begin, shape (2 J,)."""
    return np.concatenate([parameters.inflation, parameters.muscle])


def with_amplitudes(parameters: Parameters, amplitudes: NDArray[np.float64]) -> Parameters:
    """The same parameters with other amplitudes, shape (2 J,)."""
    inflation, muscle = np.split(np.asarray(amplitudes, dtype=np.float64), 2)
    return replace(parameters, inflation=inflation, muscle=muscle)


class LinearDeformation:
    """A covering over F poses as a function of its 2 J amplitudes; all else is as its parameters have it.

    Attributes:
        ratio: Flexion ratios that drive the roundings, shape (F, J).

    Args:
        covering: A bound surface.
        poses: F poses of its skeleton.

    Raises:
        InputError: Poses that do not fit or are not finite.
    """

    def __init__(self, covering: Covering, poses: Poses) -> None:
        covering.check(poses)
        self.covering = covering
        anchors, fields, skeleton = covering.anchors, covering.fields, covering.skeleton
        self._drivers = drive(skeleton, anchors, poses)
        scalars = scalar_inputs(anchors, covering.parameters, self._drivers)
        joints = len(skeleton)
        middle = joints + fields.palm.shape[1]
        self.ratio, self._palm, self._driven = scalars[:, :joints], scalars[:, joints:middle], scalars[:, middle:]
        for driven in (self.ratio, self._driven):
            driven[driven < _STILL] = 0.0
        self._offset = fields.offsets(anchors.rest, skeleton.rest)
        self._roundings, self._muscles = fields.roundings.tocoo(), fields.muscles.tocoo()
        table = SegmentTable.build(skeleton, anchors.ends)
        self._heights = table.heights(anchors.rest[self._muscles.coords[0]], self._muscles.coords[1])
        self._begins = anchors.ends[:, 0]

    def __len__(self) -> int:
        return len(self.ratio)

    @property
    def count(self) -> int:
        """Amplitudes: 2 J."""
        return 2 * len(self.covering.skeleton)

    def frame(self, frame: int) -> tuple[NDArray[np.float64], sp.csr_array]:
        """B [m], shape (V, 3), and D [m], shape (3 V, 2 J), of one pose; rows of D are x, y, z of a vertex."""
        drivers, fields = self._drivers, self.covering.fields
        turns = np.concatenate([drivers.halfway[frame], drivers.rotations[frame]])
        turn = unit(fields.turns @ turns)
        thick = 1.0 + fields.palm @ self._palm[frame]
        offset = rotate(turn, self._offset)
        base = fields.positions @ drivers.positions[frame] + thick[:, None] * offset

        row, joint = self._roundings.coords
        strength = self._roundings.data * self.ratio[frame, joint]
        kept = np.flatnonzero(strength)
        rounding = strength[kept, None] * offset[row[kept]]
        rows, columns = [row[kept]], [joint[kept]]

        row, segment = self._muscles.coords
        strength = self._muscles.data * self._driven[frame, segment]
        kept = np.flatnonzero(strength)
        muscle = strength[kept, None] * rotate(turn[row[kept]], self._heights[kept])
        rows.append(row[kept])
        columns.append(len(self.covering.skeleton) + self._begins[segment[kept]])

        value = np.concatenate([rounding, muscle])
        place = 3 * np.concatenate(rows)[:, None] + np.arange(3)
        column = np.repeat(np.concatenate(columns), 3)
        shape = (3 * len(base), self.count)
        return base, sp.coo_array((value.ravel(), (place.ravel(), column)), shape=shape).tocsr()

    def points(self, amplitudes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Final positions of all vertices [m], shape (F, V, 3)."""
        out = np.empty((len(self), len(self.covering.surface.vertices), 3))
        for f in range(len(self)):
            base, directions = self.frame(f)
            out[f] = base + (directions @ amplitudes).reshape(-1, 3)
        return out
