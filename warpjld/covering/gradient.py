"""Derivatives of the deformation with respect to the animator's parameters and to what the pose gives it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from warpjld.covering.covering import Covering
from warpjld.covering.device import anchors_on, checked_device, drivers_on, parameters_on
from warpjld.covering.drivers import Drivers, drive
from warpjld.covering.paper import PaperCovering
from warpjld.covering.parameters import Parameters
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses

__all__ = ["Differentiable", "Gradients"]


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of one number with respect to every input, each shaped as the input is.

    Attributes:
        parameters: With respect to the parameters of the joints.
        pose: With respect to the inputs of the operators, frame by frame. Positions, rotations and halfway rotations
            count as independent of one another; quaternion entries, as four free numbers.
    """

    parameters: Parameters
    pose: Drivers


class Differentiable:
    """The covering formula over fixed poses, with its vector-Jacobian product.

    >>> deformation = Differentiable(covering, poses)
    >>> moved = deformation.forward(parameters)               # (F, n, 3)
    >>> gradients = deformation.backward(2.0 * (moved - goal))  # of Σ |moved − goal|²
    >>> gradients.parameters.muscle                            # (J,)

    The places of the vertices are those of ``covering``: where parameters move them between palm segments
    (proximities, A Fig. 7), that is neither followed nor differentiated. Take ``covering.with_parameters`` for it.

    Args:
        covering: A bound surface.
        poses: F poses of its skeleton.
        vertices: Vertices to follow; all V by default.
        device: Warp device.

    Raises:
        InputError: Poses that do not fit or are not finite, a vertex that does not exist, an unknown device.
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
        self._anchors = anchors_on(self._device, covering.anchors, covering.skeleton.rest)
        self._chosen = wp.array(chosen, dtype=wp.int32, device=self._device)
        drivers = drive(covering.skeleton, covering.anchors, poses)
        self._pose = drivers_on(self._device, drivers, requires_grad=True)
        self._shape = (len(poses), len(chosen))
        self._step: tuple[wp.Tape, Any, wp.array] | None = None

    def forward(self, parameters: Parameters | None = None) -> NDArray[np.float32]:
        """Final positions [m], shape (F, n, 3), with other parameters than the covering's if given."""
        import warp as wp
        from warpjld_kernels.anchored_gradient import deform_points_with_gradient

        chosen = self._covering.parameters if parameters is None else parameters
        chosen.check(self._covering.skeleton)
        # a tape's backward reads arrays as they are then: parameters and outputs are made afresh at every step
        values = parameters_on(self._device, chosen, requires_grad=True)
        points = wp.empty(self._shape, dtype=wp.vec3, device=self._device, requires_grad=True)
        tape = wp.Tape()
        with tape:
            wp.launch(
                deform_points_with_gradient,
                dim=self._shape,
                inputs=[self._anchors, values, self._chosen, *self._pose],
                outputs=[points],
                device=self._device,
            )
        self._step = (tape, values, points)
        result: NDArray[np.float32] = points.numpy().copy()
        return result

    def backward(self, adjoint: NDArray) -> Gradients:
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
        tape, values, points = self._step
        tape.zero()
        seed = wp.array(np.ascontiguousarray(adjoint, dtype=np.float32), dtype=wp.vec3, device=self._device)
        tape.backward(grads={points: seed})
        by_parameter = {f.name: _gradient(getattr(values, f.name)) for f in fields(Parameters)}
        by_driver = (_gradient(a) for a in self._pose)
        return Gradients(Parameters(**by_parameter), Drivers(*by_driver))


def _gradient(array: Any) -> NDArray[np.float64]:
    out: NDArray[np.float64] = array.grad.numpy().astype(np.float64)
    return out
