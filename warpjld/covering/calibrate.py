"""Fit of the amplitudes to a rig: volume preserved over its joint ranges, without folds, roughness or stretch.

Only amplitudes are fitted: positions are linear in them, so Gauss–Newton takes a few steps and no field is diffused
again. The parameters that shape the fields (proximities, peaks, exponents) change little once these are diffused.
Constraints keep all_poses pose from getting rougher or losing volume; folds, which have no derivative, are counted
afterwards, and the amplitudes that cause them are moved back towards their start.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from warpjld.covering.amplitudes import amplitudes_of, with_amplitudes
from warpjld.covering.calibration_guard import Guard, PoseMeasures
from warpjld.covering.calibration_loss import LossWeights
from warpjld.covering.calibration_retreat import retreat
from warpjld.covering.constrained_least_squares import minimise_constrained
from warpjld.covering.covering import Covering
from warpjld.covering.parameters import Parameters
from warpjld.covering.pose_losses import PoseLosses
from warpjld.covering.pose_sets import calibration_poses, guard_poses
from warpjld.covering.tolerances import TOLERANCES, Tolerances
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses

__all__ = ["Calibration", "CalibrationStatus", "calibrate"]

_HIGHEST = 1.0  # upper bound of amplitudes: at full flexion the skin then is twice as far from the bone
_PULL = 0.3  # weight of the squared change of an amplitude: regularises what the surface does not determine


class CalibrationStatus(Enum):
    """How a calibration ended; the values are messages for users."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "stopped at the iteration limit"
    UNCHANGED = "the start was the best found"


@dataclass(frozen=True, eq=False)
class Calibration:
    """Result of :func:`calibrate`.

    Attributes:
        parameters: The best parameters found; in no pose worse than the start, within ``Tolerances``.
        status: How it ended.
        iterations: Steps of the minimiser.
        evaluations: Evaluations of the loss with its derivatives.
        seconds: Time taken.
        poses: Poses fitted to.
        guards: Further poses that were not allowed to get worse.
        kept: Joints whose amplitudes were moved back towards the start, since poses in which they bend got worse.
        loss: Value of the loss, at the start and with ``parameters``.
        before: Measures of all poses at the start, those fitted to first.
        after: The same with ``parameters``.
    """

    parameters: Parameters
    status: CalibrationStatus
    iterations: int
    evaluations: int
    seconds: float
    poses: int
    guards: int
    kept: tuple[str, ...]
    loss: tuple[float, float]
    before: PoseMeasures
    after: PoseMeasures

    def __repr__(self) -> str:
        before, after = self.loss
        return f"Calibration({self.status.value}, loss {before:.3g} to {after:.3g} over {self.poses} poses)"


def calibrate(
    covering: Covering,
    poses: Poses | None = None,
    *,
    guards: Poses | None = None,
    iterations: int = 14,
    weights: LossWeights | None = None,
    tolerances: Tolerances = TOLERANCES,
    progress: Callable[[str, int, int], None] | None = None,
) -> Calibration:
    """Fit the parameters of a covering to its surface.

    Args:
        covering: A bound surface; its parameters are the start.
        poses: Poses to fit to, over the joint ranges; by default
            :func:`~warpjld.covering.pose_sets.calibration_poses`.
        guards: Further poses that may not get worse; by default :func:`~warpjld.covering.pose_sets.guard_poses`.
        iterations: Maximum number of evaluations of the loss.
        weights: Weights of the loss.
        tolerances: By how much a pose may be worse than at the start.
        progress: Called with the name of the phase, its steps done, and the number of its steps.

    Raises:
        InputError: Fewer than one iteration, no poses, or poses of another skeleton.

    Examples:
        >>> hand = wj.build_hand("left", resolution=1500)
        >>> covering = wj.bind(hand)
        >>> motion = wj.Motion()
        >>> motion.set_key("index.base.flexion", 0, 0.6)  # rad
        >>> poses = motion.poses(hand.skeleton)
        >>> found = wj.calibrate(covering, poses, guards=poses, iterations=1)
        >>> found.loss[1] <= found.loss[0]
        True
        >>> calibrated = covering.with_parameters(found.parameters)
    """
    if iterations < 1:
        raise InputError(f"iterations: want at least 1, got {iterations}")
    poses = calibration_poses(covering.skeleton) if poses is None else poses
    guards = guard_poses(covering.skeleton) if guards is None else guards
    if not len(poses):
        raise InputError("poses: want at least one to calibrate on")
    if not len(covering.flesh.faces):
        raise InputError("calibrate: all of this surface is rigid; want flesh that deforms")
    for pose_set in (poses, guards):
        covering.check(pose_set)
    started = time.perf_counter()
    report = progress or (lambda what, done, total: None)
    all_poses = _concatenated(poses, guards)
    losses = PoseLosses(
        covering, all_poses, len(poses), weights, tolerances, lambda done, total: report("posing", done, total)
    )
    guard = Guard(covering, all_poses, losses, tolerances, lambda done, total: report("measuring", done, total))
    start = amplitudes_of(covering.parameters)
    fit = minimise_constrained(
        losses.parts,
        start,
        (np.zeros_like(start), np.maximum(start, _HIGHEST)),
        np.full(len(start), _PULL),
        evaluations=iterations,
        progress=lambda done, total: report("fitting", done, total),
    )
    amplitudes, after, kept = retreat(covering, fit.x, losses, guard, report)
    status = CalibrationStatus.CONVERGED if fit.converged else CalibrationStatus.ITERATION_LIMIT
    if np.array_equal(amplitudes, start):
        status = CalibrationStatus.UNCHANGED
    fitted = losses.fitted
    return Calibration(
        with_amplitudes(covering.parameters, amplitudes),
        status,
        fit.iterations,
        fit.evaluations,
        time.perf_counter() - started,
        len(poses),
        len(guards),
        kept,
        (sum(p.before.total for p in fitted), sum(p.terms(amplitudes).total for p in fitted)),
        guard.first,
        after,
    )


def _concatenated(poses: Poses, more: Poses) -> Poses:
    return Poses(
        np.concatenate([poses.positions, more.positions]),
        np.concatenate([poses.rotations, more.rotations]),
        np.concatenate([poses.flexion, more.flexion]),
    )
