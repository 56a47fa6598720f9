"""Coefficients of the covering formula as fields on the surface: one number per vertex and pose input.

    S' = Σ c_j J_j' + rot(normalise(Σ w_k q_k), (1 + Σ (g_i + s_i) f_i) d + Σ m_s f_s h_s),  d = S − Σ c_j J_j

with positions J', rotations q and flexion ratios f of a pose, and the height vector h_s of a vertex over a segment. As
fields they can be diffused and thinned out before use; d is computed from the resulting c, so that the rest pose stays
exact.
"""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors, smoothstep
from warpjld.covering.device import array_on, checked_device
from warpjld.covering.parameters import Parameters
from warpjld.runtime.lazily import lazy_module

if TYPE_CHECKING:
    import scipy.sparse as sp
else:
    sp = lazy_module("scipy.sparse")

__all__ = ["Fields", "OperatorKernel", "joint_of_column", "operator_fields"]

_PIVOT = 0.15
"""Share of a segment at either end whose vertices turn about the joint itself, so that cross-sections keep their
distance from the joint, and with it their volume; with centres interpolated all along the segment, cross-sections cut
the corner. Larger shares gain little more, and knuckles get sharper."""
_KINDS = ("positions", "turns", "roundings", "swellings", "palm", "muscles")


@dataclass(frozen=True, eq=False)
class Fields:
    """Sparse coefficients of V vertices, without the amplitudes of the parameters.

    Attributes:
        positions: Coefficients of the joints' positions, shape (V, J); rows sum to one.
        turns: Of the J halfway rotations, then of the J bones' rotations, shape (V, 2 J); rows sum to one.
        roundings: Of the joints' flexion ratios, within the joints' proximities, shape (V, J).
        swellings: Of the joints' flexion ratios, over the whole of a joint's segments, shape (V, J): the flesh that
            bending displaces.
        palm: Of the palm pairs' thickening at their stations, shape (V, N · STATIONS).
        muscles: Of the segments' muscles, shape (V, S).
    """

    positions: sp.csr_array
    turns: sp.csr_array
    roundings: sp.csr_array
    swellings: sp.csr_array
    palm: sp.csr_array
    muscles: sp.csr_array

    def stacked(self) -> sp.csr_array:
        """All fields side by side, in the order of the attributes, shape (V, columns)."""
        return sp.csr_array(sp.hstack([getattr(self, kind) for kind in _KINDS], format="csr"))

    def like(self, stacked: sp.csr_array | NDArray[np.float64]) -> Fields:
        """Fields of the same widths as these, from a stacked matrix (see :meth:`stacked`)."""
        ends = np.cumsum([getattr(self, kind).shape[1] for kind in _KINDS])
        columns = sp.csc_array(stacked)
        return Fields(*(columns[:, a:b].tocsr() for a, b in zip([0, *ends[:-1]], ends, strict=True)))

    def offsets(self, rest: NDArray[np.float64], joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """d of every vertex [m], shape (V, 3), from the rest positions of vertices (V, 3) and joints (J, 3)."""
        return np.asarray(rest - self.positions @ joints)


def joint_of_column(anchors: Anchors, joints: int) -> NDArray[np.int64]:
    """The joint around which each column of the stacked fields lies, shape (columns,)."""
    own = np.arange(joints)
    pairs = anchors.ends[anchors.pairs[:, 0], 0] if len(anchors.pairs) else np.zeros(0, dtype=np.int64)
    return np.concatenate([own, own, own, own, own, np.repeat(pairs, STATIONS), anchors.ends[:, 0]]).astype(np.int64)


def operator_fields(anchors: Anchors, parameters: Parameters) -> Fields:
    """Fields of the operators before diffusion, from the vertices' coordinates on their segments."""
    return OperatorKernel(anchors, parameters).fields


class OperatorKernel:
    """Fields of the operators, and their vector-Jacobian product with respect to the parameters.

    Attributes:
        fields: Result of :func:`operator_fields`.
    """

    def __init__(self, anchors: Anchors, parameters: Parameters, *, requires_grad: bool = False) -> None:
        import warp as wp

        if requires_grad:
            from warpjld_kernels.operator_fields_gradient import operator_fields_with_gradient as kernel
        else:
            from warpjld_kernels.operator_fields import operator_fields as kernel

        device = checked_device("cpu")
        self._anchors = anchors
        shape = anchors.weight.shape
        self._out = [
            wp.empty(shape, dtype=kind, device=device, requires_grad=requires_grad)
            for kind in (wp.vec3, wp.vec2, float)
        ]
        places = [("ends", wp.int32), ("muscle", float), ("segment", wp.int32), ("weight", float), ("ratio", float)]
        self._inputs = [array_on(device, getattr(anchors, n), kind) for n, kind in (*places, ("side", float))]
        self._values = [
            array_on(device, a, float, requires_grad=requires_grad)
            for a in (parameters.proximity, parameters.peak, parameters.exponents)
        ]
        self._tape = wp.Tape()
        with self._tape if requires_grad else nullcontext():
            inputs = [*self._inputs, *self._values]
            wp.launch(kernel, dim=shape, inputs=inputs, outputs=self._out, device=device)
        self._layout(len(parameters.inflation))

    def _layout(self, joints: int) -> None:
        """Assemble ``fields`` from the kernel's values at each vertex and segment."""
        anchors = self._anchors
        turn, rounding, muscle = (a.numpy() for a in self._out)
        proximal, distal = anchors.ends[anchors.segment, 0], anchors.ends[anchors.segment, 1]
        is_rigid = (anchors.rigid >= 0).astype(np.float64)[:, None]
        follows = np.maximum(anchors.rigid, 0)[:, None]
        between = np.clip((anchors.ratio - _PIVOT) / (1.0 - 2.0 * _PIVOT), 0.0, 1.0)
        positions = [
            (proximal, anchors.weight * (1.0 - between)),
            (distal, anchors.weight * between),
            (follows, is_rigid),
        ]
        self._turn_columns = (proximal, joints + proximal, distal)
        turns = [*((c, turn[..., k]) for k, c in enumerate(self._turn_columns)), (joints + follows, is_rigid)]
        self._rounding_columns = (proximal, distal)
        roundings = [(c, rounding[..., k]) for k, c in enumerate(self._rounding_columns)]
        low = np.minimum(anchors.station.astype(int), STATIONS - 2)
        part = anchors.station - low
        first = STATIONS * anchors.pair + low
        palm = [(first, anchors.between * (1.0 - part)), (first + 1, anchors.between * part)]
        vertices = len(anchors)
        self.fields = Fields(
            _sparse(positions, vertices, joints),
            _sparse(turns, vertices, 2 * joints),
            _sparse(roundings, vertices, joints),
            _sparse(_swellings(anchors), vertices, joints),
            _sparse(palm if len(anchors.pairs) else [], vertices, STATIONS * len(anchors.pairs)),
            _sparse([(anchors.segment, muscle)], vertices, len(anchors.ends)),
        )

    def backward(
        self, turns: NDArray[np.float64], roundings: NDArray[np.float64], muscles: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives of a number by proximity (J, 2), peak (J,) and exponents (J, 2), from its derivatives by the
        fields of turns (V, 2 J), roundings (V, J) and muscles (V, S). Needs ``requires_grad``."""
        import warp as wp

        rows = np.arange(len(self._anchors))[:, None]
        adjoints = [
            np.stack([turns[rows, c] for c in self._turn_columns], axis=-1),
            np.stack([roundings[rows, c] for c in self._rounding_columns], axis=-1),
            muscles[rows, self._anchors.segment],
        ]
        self._tape.zero()
        seeds = {
            out: wp.array(np.ascontiguousarray(a, dtype=np.float32), dtype=out.dtype, device="cpu")
            for out, a in zip(self._out, adjoints, strict=True)
        }
        self._tape.backward(grads=seeds)
        proximity, peak, exponents = (a.grad.numpy().astype(np.float64) for a in self._values)
        return proximity, peak, exponents


def _swellings(anchors: Anchors) -> list[tuple[NDArray, NDArray]]:
    """Columns and values of the swelling field: 1 at a joint, falling smoothly to 0 at the other end of its segment.

    Only on the external side and the flanks, since more flesh on the inside of a bend would collide; stiff segments (a
    skull) do not swell.
    """
    t = np.clip(anchors.ratio, 0.0, 1.0)
    amount = anchors.weight * anchors.side * ~anchors.stiff[anchors.segment]
    ends = (anchors.ends[anchors.segment, k] for k in (0, 1))
    return [(end, amount * smoothstep(near)) for end, near in zip(ends, (1.0 - t, t), strict=True)]


def _sparse(entries: list[tuple[NDArray, NDArray]], rows: int, width: int) -> sp.csr_array:
    """Sparse (rows, width) from columns (rows, k) and values (rows, k); entries of the same place are summed."""
    if not entries or not width:
        return sp.csr_array((rows, width))
    row = np.concatenate([np.repeat(np.arange(rows), c.shape[1]) for c, _ in entries])
    column = np.concatenate([c.ravel() for c, _ in entries])
    value = np.concatenate([v.ravel() for _, v in entries]).astype(np.float64)
    kept = value != 0.0
    out = sp.coo_array((value[kept], (row[kept], column[kept])), shape=(rows, width)).tocsr()
    out.sum_duplicates()
    return out
