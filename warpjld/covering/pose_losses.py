"""Calibration losses of a set of poses, as functions of a covering's amplitudes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.amplitudes import LinearDeformation
from warpjld.covering.calibration_loss import LossWeights, PoseLoss, SurfaceLoss
from warpjld.covering.covering import Covering
from warpjld.covering.tolerances import TOLERANCES, Tolerances
from warpjld.skeleton.kinematics import Poses

__all__ = ["PoseLosses"]


class PoseLosses:
    """The losses of all poses of a covering, and the vertices that amplitudes move in each.

    Attributes:
        of_pose: Loss of each pose; None where amplitudes move no vertex.
        moved: Vertices that amplitudes move, one array a pose.
        regions: Volume that they move [m³], shape (F,).
        still: Sum of the squared growth of the dihedral angles that they do not change [rad²], shape (F,).

    Args:
        covering: The covering with the amplitudes to start from.
        poses: F poses.
        fitted: Number of poses to fit to, the first ones; the others only have constraints.
        weights: Weights of the terms.
        tolerances: By how much a pose may be worse than at the start.
        progress: Called with the number of poses done, and of all.
    """

    def __init__(
        self,
        covering: Covering,
        poses: Poses,
        fitted: int,
        weights: LossWeights | None = None,
        tolerances: Tolerances = TOLERANCES,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        shared = SurfaceLoss(covering.flesh, covering.fields.positions @ covering.skeleton.rest, weights, tolerances)
        deformation = LinearDeformation(covering, poses)
        self.of_pose: list[PoseLoss | None] = []
        self.moved: list[NDArray[np.int64]] = []
        self.regions = np.zeros(len(poses))
        self.still = np.zeros(len(poses))
        self._fitted = fitted
        for frame in deformation.frames():
            still = self.still[frame.number] = shared.still(frame)
            only_held = frame.number >= fitted
            self.of_pose.append(shared.pose(frame, deformation.amplitudes, still, only_held=only_held))
            self.moved.append(frame.moved)
            self.regions[frame.number] = shared.region(frame)
            if progress:
                progress(frame.number + 1, len(poses))

    @property
    def parts(self) -> list[PoseLoss]:
        """Losses of all poses in which amplitudes move any vertex."""
        return [part for part in self.of_pose if part is not None]

    @property
    def fitted(self) -> list[PoseLoss]:
        """Those of the poses to fit to."""
        return [part for part in self.of_pose[: self._fitted] if part is not None]
