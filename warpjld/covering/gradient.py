"""Derivatives of the deformation with respect to the animator's parameters and the pose inputs, in reverse mode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from warpjld.covering.covering import Covering
from warpjld.covering.device import checked_device
from warpjld.covering.drivers import Drivers, drive, initial_ratio
from warpjld.covering.fields import Fields, OperatorKernel
from warpjld.covering.paper import PaperCovering
from warpjld.covering.parameters import Parameters
from warpjld.covering.rows import Padded, Rows, palm_exponents, pose_on, rows_of, rows_on
from warpjld.covering.thinning import thinned, thinned_slope
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses

__all__ = ["Differentiable", "Gradients"]


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of one number with respect to every input, each of the input's shape.

    Attributes:
        parameters: With respect to the parameters of the joints.
        pose: With respect to the pose inputs of the operators, frame by frame. Positions, rotations and halfway
            rotations count as independent of one another, and the four entries of a quaternion too.
    """

    parameters: Parameters
    pose: Drivers


class Differentiable:
    """The covering formula over fixed poses, with its vector-Jacobian product.

    The vertices' weights between palm segments and the swelling are those of ``covering``: their dependence on the
    parameters (proximities, A Fig. 7) is neither evaluated nor differentiated. ``covering.with_parameters`` updates
    them.

    Args:
        covering: A bound surface.
        poses: F poses of its skeleton.
        vertices: Indices of the vertices to deform, n; all V by default.
        device: Warp device.

    Raises:
        InputError: Poses of another skeleton or not finite, a vertex index out of range, an unknown device, or a
            covering by the paper's operators.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering, motion = wj.bind(hand), wj.Motion()
        >>> motion.set_key("index.base.flexion", 0, 1.0)  # rad
        >>> deformation = wj.Differentiable(covering, motion.poses(hand.skeleton))
        >>> moved = deformation.forward()  # (F, V, 3)
        >>> goal = moved + 0.001
        >>> gradients = deformation.backward(2.0 * (moved - goal))  # of Σ |moved − goal|²
        >>> gradients.parameters.muscle.shape
        (26,)
    """

    def __init__(
        self, covering: Covering, poses: Poses, vertices: ArrayLike | None = None, *, device: str = "cpu"
    ) -> None:
        import warp as wp

        self._covering = covering
        self._device = checked_device(device)
        covering.check(poses)
        if isinstance(covering, PaperCovering):
            raise InputError(
                "covering: the paper's hard-edged operators have no derivatives; bind with method='smooth'"
            )
        chosen = covering.chosen(np.arange(len(covering.surface.vertices)) if vertices is None else vertices)
        self._chosen = wp.array(chosen, dtype=wp.int32, device=self._device)
        self._drivers = drive(covering.skeleton, covering.anchors, poses)
        self._shape = (len(poses), len(chosen))
        self._step: _Step | None = None

    def forward(self, parameters: Parameters | None = None) -> NDArray[np.float32]:
        """Final positions [m], shape (F, n, 3), with other parameters than the covering's if given."""
        import warp as wp
        from warpjld_kernels.rows_gradient import deform_rows_with_gradient

        covering = self._covering
        chosen = covering.parameters if parameters is None else parameters
        chosen.check(covering.skeleton)
        shapes = None
        spread, thin = covering.spread, covering.fields
        if not chosen.shapes_like(covering.parameters):
            shapes = OperatorKernel(covering.anchors, chosen, requires_grad=True)
            spread = covering.diffused(shapes.fields)
            thin = thinned(spread)
        rows = rows_of(thin, covering.skeleton, covering.anchors, chosen, covering.swelling, covering.thickening)
        # the tape's backward pass reads the arrays' contents at that time, so inputs and outputs are allocated anew
        values = rows_on(self._device, rows, requires_grad=True)
        pose = pose_on(self._device, covering.anchors, chosen, self._drivers, requires_grad=True)
        points = wp.empty(self._shape, dtype=wp.vec3, device=self._device, requires_grad=True)
        tape = wp.Tape()
        with tape:
            wp.launch(
                deform_rows_with_gradient,
                dim=self._shape,
                inputs=[values, self._chosen, *pose],
                outputs=[points],
                device=self._device,
            )
        self._step = _Step(tape, values, pose, points, chosen, shapes, spread, thin, rows)
        result: NDArray[np.float32] = points.numpy().copy()
        return result

    def backward(self, adjoint: NDArray[np.floating]) -> Gradients:
        """Derivatives of Σ adjoint · positions at the last :meth:`forward`.

        Args:
            adjoint: Derivative of the caller's number with respect to the positions, shape (F, n, 3).

        Raises:
            InputError: No forward pass yet, or an adjoint of another shape.
        """
        import warp as wp

        if self._step is None:
            raise InputError("backward: call forward first")
        if adjoint.shape != (*self._shape, 3):
            raise InputError(f"adjoint: want shape {(*self._shape, 3)}, got {adjoint.shape}")
        step = self._step
        step.tape.zero()
        seed = wp.array(np.ascontiguousarray(adjoint, dtype=np.float32), dtype=wp.vec3, device=self._device)
        step.tape.backward(grads={step.points: seed})
        positions, turns, scalars = (_gradient(a) for a in step.pose)
        joints = len(self._covering.skeleton)
        return Gradients(
            self._by_parameters(step, scalars),
            Drivers(positions, turns[:, :joints], turns[:, joints:], *self._by_scalars(step, scalars)),
        )

    def _by_scalars(self, step: _Step, slope: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives by flexion ratios (F, J) and by log λ (F, N, STATIONS), from those by the scalar inputs."""
        anchors, joints = self._covering.anchors, len(self._covering.skeleton)
        muscles = slope[:, step.rows.scales.shape[1] :]
        ratio = slope[:, :joints].copy()
        for end in range(2):
            np.add.at(ratio.T, anchors.ends[:, end], 0.5 * muscles.T)
        closing = np.zeros_like(self._drivers.closing)
        if len(anchors.pairs):
            exponent = palm_exponents(anchors, step.parameters)[:, None]
            palm = slope[:, joints : step.rows.scales.shape[1]].reshape(closing.shape)
            closing = -exponent * np.exp(-exponent * self._drivers.closing) * palm
        return ratio, closing

    def _by_parameters(self, step: _Step, scalars: NDArray[np.float64]) -> Parameters:
        """Derivatives by all parameters, from those of the tape and those by the scalar inputs."""
        covering, anchors, chosen = self._covering, self._covering.anchors, step.parameters
        rows, joints, vertices = step.rows, len(self._covering.skeleton), len(self._covering.anchors)
        scale_slope = _entries(rows.scales, step.values.scale)
        unit = Padded.of(rows.muscles)
        by_vector = unit.sums(_gradient(step.values.muscle), len(rows.muscles.data))
        muscle_slope = (by_vector * rows.heights).sum(axis=1)  # by what scales the height: amplitude × field
        initial = initial_ratio(covering.skeleton)
        if initial.any():  # the offsets of straight joints depend on the amplitudes where joints are bent at rest
            ratio = np.concatenate([initial, np.zeros(rows.scales.shape[1] - joints)])
            by_offset = _gradient(step.values.offset) / (1.0 + rows.scales @ ratio)[:, None]
            vertex = np.repeat(np.arange(vertices), np.diff(rows.scales.indptr))
            scale_slope -= (by_offset * rows.offset).sum(axis=1)[vertex] * ratio[rows.scales.indices]
            vertex = np.repeat(np.arange(vertices), np.diff(rows.muscles.indptr))
            driven = 0.5 * initial[anchors.ends].sum(axis=1)[rows.muscles.indices]
            muscle_slope -= (by_offset[vertex] * rows.heights).sum(axis=1) * driven
        by_rounding = sp.csr_array((scale_slope, rows.scales.indices, rows.scales.indptr), shape=rows.scales.shape)
        by_rounding = by_rounding.tocsc()[:, :joints].toarray()
        by_muscle = sp.csr_array((muscle_slope, rows.muscles.indices, rows.muscles.indptr), shape=rows.muscles.shape)
        by_muscle = by_muscle.toarray()
        first = anchors.ends[:, 0]
        muscle = np.zeros(joints)
        np.add.at(muscle, first, (by_muscle * step.thin.muscles.toarray()).sum(axis=0))
        palm = np.zeros(joints)
        if len(anchors.pairs):
            exponent = palm_exponents(anchors, chosen)[:, None]
            slope = scalars[:, joints : rows.scales.shape[1]].reshape(self._drivers.closing.shape)
            by_exponent = (-self._drivers.closing * np.exp(-exponent * self._drivers.closing) * slope).sum(axis=(0, 2))
            for end in range(2):
                np.add.at(palm, anchors.ends[anchors.pairs[:, end], 0], 0.5 * by_exponent)
        shapes = step.shapes or OperatorKernel(anchors, chosen, requires_grad=True)
        turns = sp.csr_array(
            (_entries(rows.turns, step.values.turn), rows.turns.indices, rows.turns.indptr), shape=rows.turns.shape
        )
        slopes = Fields(
            sp.csr_array((vertices, joints)),
            sp.csr_array(thinned_slope(step.spread.turns, step.thin.turns, turns.toarray())),
            sp.csr_array(by_rounding * chosen.inflation * (step.thin.roundings.toarray() != 0.0)),
            sp.csr_array((vertices, joints)),
            sp.csr_array(step.thin.palm.shape),
            sp.csr_array(by_muscle * chosen.muscle[first] * (step.thin.muscles.toarray() != 0.0)),
        )
        undiffused = covering.before_diffusion(slopes, shapes.fields)
        proximity, peak, exponents = shapes.backward(
            undiffused.turns.toarray(), undiffused.roundings.toarray(), undiffused.muscles.toarray()
        )
        inflation = (by_rounding * step.thin.roundings.toarray()).sum(axis=0)
        return Parameters(inflation, proximity, muscle, peak, exponents, palm)


@dataclass(frozen=True, eq=False)
class _Step:
    """Arrays of a forward pass that its backward pass needs."""

    tape: Any
    values: Any
    pose: list[Any]
    points: Any
    parameters: Parameters
    shapes: OperatorKernel | None
    spread: Fields
    thin: Fields
    rows: Rows


def _entries(matrix: sp.csr_array, padded: Any) -> NDArray[np.float64]:
    """Derivatives by the stored entries of a matrix, from those by its padded array on the device."""
    return Padded.of(matrix).sums(_gradient(padded), len(matrix.data))


def _gradient(array: Any) -> NDArray[np.float64]:
    out: NDArray[np.float64] = array.grad.numpy().astype(np.float64)
    return out
