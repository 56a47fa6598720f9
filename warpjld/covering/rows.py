"""Rows of coefficients per vertex and kind of pose input, amplitudes included, and their layout for the kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.covering.device import array_on
from warpjld.covering.drivers import Drivers, initial_ratio
from warpjld.covering.fields import Fields
from warpjld.covering.parameters import Parameters
from warpjld.covering.segment_table import SegmentTable
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton.tree import Skeleton

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Padded", "Rows", "palm_exponents", "pose_on", "rows_of", "rows_on", "scalar_inputs"]


@dataclass(frozen=True, eq=False)
class Rows:
    """Coefficients of V vertices with amplitudes.

    Attributes:
        positions: Coefficients of the joints' positions, shape (V, J).
        turns: Of the halfway rotations and the bones' rotations, shape (V, 2 J).
        scales: Of the flexion ratios and of the palm pairs' thickening, shape (V, J + N · STATIONS).
        muscles: Of the segments' muscles, shape (V, S).
        heights: Height vector that each entry of ``muscles`` multiplies [m], shape (entries, 3).
        offset: d of straight joints [m], shape (V, 3).
    """

    positions: sp.csr_array
    turns: sp.csr_array
    scales: sp.csr_array
    muscles: sp.csr_array
    heights: NDArray[np.float64]
    offset: NDArray[np.float64]


def rows_of(
    fields: Fields,
    skeleton: Skeleton,
    anchors: Anchors,
    parameters: Parameters,
    swelling: NDArray[np.float64] | None = None,
    thickening: NDArray[np.float64] | None = None,
) -> Rows:
    """Rows of diffused and thinned fields with these amplitudes (R58–R65).

    Roundings are multiplied by the inflation of their joint, muscles by the muscle amplitude of the joint where the
    segment begins, swellings by the amplitude ``swelling`` of their joint, shape (J,), zero by default, and what palm
    pairs thicken by the factor ``thickening`` of their pair, shape (N,), one by default. Offsets are those of straight
    joints: together with the inflation by the initial angles they give the rest pose (C24, R25).
    """
    muscles = _times(fields.muscles, parameters.muscle[anchors.ends[:, 0]])
    scales = _times(fields.roundings, parameters.inflation)
    if swelling is not None and swelling.any():
        scales = _sum(scales, _times(fields.swellings, swelling))
    table = SegmentTable.build(skeleton, anchors.ends)
    vertex = np.repeat(np.arange(muscles.shape[0]), np.diff(muscles.indptr))
    heights = table.heights(anchors.rest[vertex], muscles.indices)
    offset = fields.offsets(anchors.rest, skeleton.rest)
    ratio = initial_ratio(skeleton)
    if ratio.any():
        driven = muscles.data * (0.5 * ratio[anchors.ends].sum(axis=1))[muscles.indices]
        for k in range(3):
            offset[:, k] -= np.bincount(vertex, driven * heights[:, k], len(offset))
        offset /= (1.0 + scales @ ratio)[:, None]
    palm = fields.palm if thickening is None else _times(fields.palm, np.repeat(thickening, STATIONS))
    scales = sp.csr_array(sp.hstack([scales, palm], format="csr"))
    return Rows(fields.positions, fields.turns, scales, muscles, heights, offset)


def _times(fields: sp.csr_array, amplitudes: NDArray[np.float64]) -> sp.csr_array:
    """Columns times their amplitudes. Entries are stored even where that is zero, since derivatives need them."""
    data = fields.data * amplitudes[fields.indices]
    return sp.csr_array((data, fields.indices.copy(), fields.indptr.copy()), shape=fields.shape)


def _sum(a: sp.csr_array, b: sp.csr_array) -> sp.csr_array:
    """a + b with the stored entries of both, zeros included."""
    parts = [m.tocoo() for m in (a, b)]
    index = tuple(np.concatenate([part.coords[k] for part in parts]) for k in (0, 1))
    return sp.coo_array((np.concatenate([part.data for part in parts]), index), shape=a.shape).tocsr()


def scalar_inputs(anchors: Anchors, parameters: Parameters, drivers: Drivers) -> NDArray[np.float64]:
    """Flexion ratios, thickening of the palm pairs (λ^(−k) − 1, C3) and drive of the segments' muscles of every frame,
    shape (F, J + N · STATIONS + S). Each of a segment's joints drives half of its muscle (R63)."""
    ratio = drivers.flexion_ratio
    driven = 0.5 * (ratio[:, anchors.ends[:, 0]] + ratio[:, anchors.ends[:, 1]])
    return np.concatenate([ratio, palm_thickening(anchors, parameters, drivers), driven], axis=1)


def palm_thickening(anchors: Anchors, parameters: Parameters, drivers: Drivers) -> NDArray[np.float64]:
    """λ^(−k) − 1 of every palm pair at its stations, shape (F, N · STATIONS) (R44, C3)."""
    frames = len(drivers.positions)
    if not len(anchors.pairs):
        return np.zeros((frames, 0))
    thickening = np.expm1(-palm_exponents(anchors, parameters)[:, None] * drivers.closing)
    return np.asarray(thickening.reshape(frames, len(anchors.pairs) * STATIONS))


def palm_exponents(anchors: Anchors, parameters: Parameters) -> NDArray[np.float64]:
    """k of every palm pair: the mean of those of the joints where its segments begin, shape (N,)."""
    return np.asarray(parameters.palm[anchors.ends[anchors.pairs, 0]].mean(axis=1))


@dataclass(frozen=True, eq=False)
class Padded:
    """A sparse matrix in ELLPACK layout: arrays of one width K, rows padded with zeros.

    Attributes:
        column: Column of each entry, shape (V, K).
        value: Value of each entry, shape (V, K) or (V, K, 3).
        entry: Index of each entry in the matrix's ``data``, -1 for padding, shape (V, K).
    """

    column: NDArray[np.int32]
    value: NDArray[np.float64]
    entry: NDArray[np.int64]

    @staticmethod
    def of(matrix: sp.csr_array, values: NDArray[np.float64] | None = None) -> Padded:
        """Layout of a matrix; ``values``, if given, replace its entries' values, shape (entries, …)."""
        length = np.diff(matrix.indptr)
        width = max(int(length.max(initial=0)), 1)
        inside = np.arange(width) < length[:, None]
        entry = np.full(inside.shape, -1, dtype=np.int64)
        entry[inside] = np.arange(len(matrix.data))
        column = np.zeros(inside.shape, dtype=np.int32)
        column[inside] = matrix.indices
        data = matrix.data if values is None else values
        value = np.zeros((*inside.shape, *data.shape[1:]))
        value[inside] = data
        return Padded(column, value, entry)

    def sums(self, slopes: NDArray[np.float64], size: int) -> NDArray[np.float64]:
        """Values in this layout, in the order of the matrix's entries, shape (size, …)."""
        out = np.zeros((size, *slopes.shape[2:]))
        out[self.entry[self.entry >= 0]] = slopes[self.entry >= 0]
        return out


def rows_on(device: Any, rows: Rows, *, requires_grad: bool = False) -> Any:
    """The rows as the kernels' struct ``warpjld_kernels.rows.Rows`` on a device."""
    import warp as wp
    from warpjld_kernels import rows as kernels

    out = kernels.Rows()
    vectors = rows.muscles.data[:, None] * rows.heights
    scalars = rows.scales.shape[1]
    for name, padded, kind, shift in (
        ("position", Padded.of(rows.positions), float, 0),
        ("turn", Padded.of(rows.turns), float, 0),
        ("scale", Padded.of(rows.scales), float, 0),
        ("muscle", Padded.of(rows.muscles, vectors), wp.vec3, scalars),
    ):
        setattr(out, f"{name}_input", array_on(device, padded.column + shift, wp.int32))
        setattr(out, name, array_on(device, padded.value, kind, requires_grad=requires_grad))
    out.offset = array_on(device, rows.offset, wp.vec3, requires_grad=requires_grad)
    return out


def pose_on(
    device: Any, anchors: Anchors, parameters: Parameters, drivers: Drivers, *, requires_grad: bool = False
) -> list[Any]:
    """Pose arguments of ``deform_rows``, in its order."""
    import warp as wp

    turns = np.concatenate([drivers.halfway, drivers.rotations], axis=1)
    scalars = scalar_inputs(anchors, parameters, drivers)
    values = ((drivers.positions, wp.vec3), (turns, wp.quat), (scalars, float))
    return [array_on(device, a, kind, requires_grad=requires_grad) for a, kind in values]
