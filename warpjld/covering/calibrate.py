"""Fitting the parameters to a rig: volume kept over its joint ranges, without folds, roughness or stretch.

Only amplitudes are fitted: positions are linear in them, so Gauss–Newton takes a few steps and nothing is diffused anew.
What shapes the fields (proximities, peaks, exponents) changes little once they are diffused. Where a pose comes out
worse than it was, the joints that bend in it go back towards the start, all the way if need be.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.amplitudes import LinearDeformation, amplitudes_of, with_amplitudes
from warpjld.covering.calibration_guard import Guard, PoseMeasures
from warpjld.covering.calibration_loss import LossWeights, PoseLoss, SurfaceLoss
from warpjld.covering.covering import Covering
from warpjld.covering.constrained_least_squares import minimise
from warpjld.covering.parameters import Parameters
from warpjld.covering.pose_sets import calibration_poses, guard_poses
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses

__all__ = ["Calibration", "CalibrationStatus", "calibrate"]

_HIGHEST = 1.0  # amplitude at full flexion: the skin then is twice as far from the bone
_PULL = 0.3  # of the squared change of an amplitude: keeps at the start what the surface does not determine
_BENT = 0.05  # flexion ratio from which a joint takes part in a pose
_BACK = (1.0, 0.7, 0.4, 0.0)  # what is left of a joint's change, each time that a pose in which it bends is worse


class CalibrationStatus(Enum):
    """How a calibration ended; the values are for people."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "stopped at the iteration limit"
    UNCHANGED = "the start was the best found"


@dataclass(frozen=True, eq=False)
class Calibration:
    """What :func:`calibrate` found.

    Attributes:
        parameters: The best found; in no pose of the sets worse than the start, within ``Tolerances``.
        status: How it ended.
        iterations: Steps of the minimiser.
        evaluations: Evaluations of the loss with its derivatives.
        seconds: Time taken.
        poses: Poses fitted to.
        guards: Poses guarded besides.
        kept: Joints that were taken back to the start or part of the way, since poses got worse.
        loss: What is made small, at the start and with ``parameters``.
        before: Measures of all poses at the start, those fitted to first, and
        after: with ``parameters``.
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


def calibrate(
    covering: Covering,
    poses: Poses | None = None,
    *,
    guards: Poses | None = None,
    iterations: int = 12,
    weights: LossWeights | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Calibration:
    """Fit the parameters of a covering to its surface.

    Args:
        covering: A bound surface; its parameters are the start.
        poses: Poses to fit to, over the joint ranges; by default
            :func:`~warpjld.covering.pose_sets.calibration_poses`.
        guards: More poses that may not get worse; by default :func:`~warpjld.covering.pose_sets.guard_poses`.
        iterations: Most steps of the minimiser.
        weights: Weights of the loss.
        progress: Called with what is being done, how much of it is done, and how much there is.

    Raises:
        InputError: Fewer than one iteration, no poses, or poses of another skeleton.
    """
    if iterations < 1:
        raise InputError(f"iterations: want at least 1, got {iterations}")
    poses = calibration_poses(covering.skeleton) if poses is None else poses
    guards = guard_poses(covering.skeleton) if guards is None else guards
    if not len(poses):
        raise InputError("poses: want at least one to calibrate on")
    if not len(covering.flesh.faces):
        raise InputError("calibrate: all of this surface is rigid, nothing is deformed")
    started = time.perf_counter()
    tell = progress or (lambda what, done, total: None)
    every = _both(poses, guards)
    losses = _Losses(covering, every, len(poses), weights, tell)
    guard = Guard(covering, every, losses.moved, losses.regions)
    start = amplitudes_of(covering.parameters)
    fit = minimise(
        losses.parts,
        start,
        (np.zeros_like(start), np.where(start > 0.0, np.maximum(start, _HIGHEST), 0.0)),
        np.full(len(start), _PULL),
        evaluations=iterations,
        progress=lambda done, total: tell("fitting", done, total),
    )
    amplitudes, after, kept = _retreat(covering, fit.x, losses.ratios, guard, tell)
    status = CalibrationStatus.CONVERGED if fit.converged else CalibrationStatus.ITERATION_LIMIT
    if np.array_equal(amplitudes, start):
        status = CalibrationStatus.UNCHANGED
    fitted = losses.parts[: losses.fitted]
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


def _both(poses: Poses, more: Poses) -> Poses:
    return Poses(
        np.concatenate([poses.positions, more.positions]),
        np.concatenate([poses.rotations, more.rotations]),
        np.concatenate([poses.flexion, more.flexion]),
    )


class _Losses:
    """The losses of all poses, those after the first ``fitted`` only held, and what amplitudes move in each."""

    def __init__(
        self,
        covering: Covering,
        poses: Poses,
        fitted: int,
        weights: LossWeights | None,
        tell: Callable[[str, int, int], None],
    ) -> None:
        shared = SurfaceLoss(covering.flesh, covering.fields.positions @ covering.skeleton.rest, weights)
        deformation = LinearDeformation(covering, poses)
        self.parts: list[PoseLoss] = []
        self.fitted = 0
        self.moved: list[NDArray[np.int64]] = []
        self.regions = np.zeros(len(poses))
        self.ratios = np.zeros((len(poses), len(covering.skeleton)))
        for frame in deformation.frames():
            self.moved.append(frame.moved)
            self.regions[frame.number] = shared.region(frame)
            self.ratios[frame.number] = frame.ratio
            part = shared.pose(frame, deformation.amplitudes, only_held=frame.number >= fitted)
            self.parts += [part] if part else []
            self.fitted += int(part is not None and frame.number < fitted)
            tell("posing", frame.number + 1, len(poses))


def _retreat(
    covering: Covering,
    amplitudes: NDArray[np.float64],
    ratios: NDArray[np.float64],
    guard: Guard,
    tell: Callable[[str, int, int], None],
) -> tuple[NDArray[np.float64], PoseMeasures, tuple[str, ...]]:
    """Amplitudes between those fitted and those at the start with which no pose is worse, their measures, and the
    joints that did not go all the way."""
    start = amplitudes_of(covering.parameters)
    names = covering.skeleton.names
    step = np.zeros(len(names), dtype=np.int64)
    while True:
        part = np.array(_BACK)[step]
        driven = part.copy()
        for segment in covering.skeleton.segments:  # both its joints drive a muscle
            driven[segment.proximal] = min(driven[segment.proximal], part[segment.distal])
        found = start + np.concatenate([part, driven]) * (amplitudes - start)
        other = covering.with_parameters(with_amplitudes(covering.parameters, found))
        measured = guard.measure(other, lambda done, total: tell("comparing", done, total))
        worse = guard.worse(measured)
        if not worse.any():
            return found, measured, tuple(names[j] for j in np.flatnonzero(step))
        step[(ratios[worse] > _BENT).any(axis=0)] += 1
        if step.max() >= len(_BACK):
            step = np.minimum(step, len(_BACK) - 1)
