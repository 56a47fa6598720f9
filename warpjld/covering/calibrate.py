"""Fitting the parameters to a rig: volume kept over its joint ranges with the least stretch.

L-BFGS-B over all parameters at once, within bounds, with the gradient of the kernels' adjoint. The regulariser keeps
what the surface does not determine at its default.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.calibration_loss import DeformationLoss, LossWeights
from warpjld.covering.covering import Covering
from warpjld.covering.gradient import Differentiable
from warpjld.covering.intersections import crossing_faces, surface_parts
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.pose_sets import calibration_poses
from warpjld.covering.quality import Stretch, edge_stretch, enclosed_volume, unique_edges
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses

__all__ = ["Calibration", "CalibrationStatus", "PoseQuality", "calibrate", "pose_quality"]

_ROUNDS = 3
"""Times the surface is bound again: proximities also place vertices between palm segments, which the gradient takes
as fixed."""

_BOUNDS = {
    "inflation": (0.0, 1.0),  # and _MOST
    "proximity": (0.05, 0.5),  # two of at most one half sum to at most one (C21)
    "muscle": (0.0, 1.0),  # and _MOST
    "peak": (0.1, 0.9),
    "exponents": (0.2, 3.0),
    "palm": (0.0, 0.5),
}
_MOST = 1.5
"""Amplitudes are at most so many times those that keep a tube's volume: a joint that bends by 15° cannot make up for
the others by a lump."""
_SCALES = {"inflation": 0.25, "proximity": 0.15, "muscle": 0.25, "peak": 0.2, "exponents": 0.5, "palm": 0.2}
_REGULARISER = 5e-3  # of the mean square of the change, in scales
_SETTLED = 1e-3  # relative gain of a round below which the next is not tried
_FACES_CHECKED = 2_000_000  # faces tested for crossing when candidates are compared
_FOLD = 10.0  # what a folding face, as a share of all faces of all poses, adds to the loss when candidates are compared


class CalibrationStatus(Enum):
    """How a calibration ended; the values are for people."""

    CONVERGED = "converged"
    ITERATION_LIMIT = "stopped at the iteration limit"
    UNCHANGED = "the start was the best found"


@dataclass(frozen=True)
class PoseQuality:
    """A covering over a set of poses.

    Attributes:
        loss: What calibration minimises, without the regulariser.
        volume_mean: Root of the mean squared relative volume error.
        volume_worst: The relative volume error of the worst pose, signed.
        stretch: Edge stretch over all poses.
        folds: Faces that cross another one of the same digit or part, over all poses tested.
        contacts: Faces that cross one of another part.
        faces: Faces tested for crossing, over all poses tested.
    """

    loss: float
    volume_mean: float
    volume_worst: float
    stretch: Stretch
    folds: int
    contacts: int
    faces: int

    @property
    def score(self) -> float:
        """What candidates are compared by: the loss, and the folds it does not see."""
        return self.loss + _FOLD * self.folds / self.faces


@dataclass(frozen=True, eq=False)
class Calibration:
    """What :func:`calibrate` found.

    Attributes:
        parameters: The best found; never worse than the start.
        status: How it ended.
        iterations: Iterations of the minimiser.
        evaluations: Evaluations of the loss with its gradient.
        seconds: Time taken.
        poses: Poses of the set.
        before: Quality over the set at the start, and
        after: with ``parameters``.
    """

    parameters: Parameters
    status: CalibrationStatus
    iterations: int
    evaluations: int
    seconds: float
    poses: int
    before: PoseQuality
    after: PoseQuality


def calibrate(
    covering: Covering,
    poses: Poses | None = None,
    *,
    iterations: int = 120,
    weights: LossWeights | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Calibration:
    """Fit the parameters of a covering to its surface.

    Args:
        covering: A bound surface; its parameters are the start and what the regulariser pulls to.
        poses: Poses over the joint ranges; by default :func:`~warpjld.covering.pose_sets.calibration_poses`.
        iterations: Most iterations of the minimiser, all rounds together.
        weights: Weights of the loss.
        progress: Called with what is done, iterations done, and ``iterations``.

    Raises:
        InputError: Fewer than one iteration, no poses, or poses of another skeleton.
    """
    from scipy.optimize import minimize

    if iterations < 1:
        raise InputError(f"iterations: want at least 1, got {iterations}")
    poses = calibration_poses(covering.skeleton) if poses is None else poses
    if not len(poses):
        raise InputError("poses: want at least one to calibrate on")
    if not len(covering.flesh.faces):
        raise InputError("calibrate: all of this surface is rigid, nothing is deformed")
    started = time.perf_counter()
    loss = DeformationLoss(covering.flesh, weights)
    variables = _Variables(covering.parameters, default_parameters(covering.skeleton))
    before = pose_quality(covering, poses, loss)
    best, best_quality, best_x = covering.parameters, before, variables.start
    done = evaluations = 0
    status = CalibrationStatus.ITERATION_LIMIT
    for _ in range(_ROUNDS):
        bound = covering.with_parameters(best)
        deformation = Differentiable(bound, poses)

        def objective(x: NDArray[np.float64], deformation: Differentiable = deformation) -> tuple[float, NDArray]:
            points = deformation.forward(variables.parameters(x))
            value, slope = loss(points)
            change = x - variables.start
            gradient = variables.gradient(deformation.backward(slope).parameters)
            value += _REGULARISER * float((change**2).mean())
            return value, gradient + 2.0 * _REGULARISER * change / change.size

        first = done

        def step(_: NDArray[np.float64]) -> None:
            nonlocal done
            done = min(done + 1, iterations)
            if progress:
                progress("calibrating", done, iterations)

        budget = max(-(-iterations // _ROUNDS), 1) if first == 0 else iterations - first
        found = minimize(
            objective,
            best_x,
            jac=True,
            method="L-BFGS-B",
            bounds=variables.bounds,
            callback=step,
            options={"maxiter": min(budget, iterations - first), "ftol": 1e-7, "gtol": 1e-7, "maxcor": 20},
        )
        evaluations += int(found.nfev)
        candidate = variables.parameters(found.x)
        quality = pose_quality(covering.with_parameters(candidate), poses, loss)
        gain = best_quality.score - quality.score
        if gain > 0.0:
            best, best_quality, best_x = candidate, quality, found.x
        if gain < _SETTLED * before.score:
            status = CalibrationStatus.CONVERGED
            break
        if done >= iterations:
            break
    if best is covering.parameters:
        status = CalibrationStatus.UNCHANGED
    seconds = time.perf_counter() - started
    return Calibration(best, status, done, evaluations, seconds, len(poses), before, best_quality)


def pose_quality(covering: Covering, poses: Poses, loss: DeformationLoss | None = None) -> PoseQuality:
    """Quality of a covering over a set of poses; crossings are looked for in as many as are quickly tested."""
    surface, flesh = covering.surface, covering.flesh
    loss = loss or DeformationLoss(flesh)
    points = covering.deform(poses)
    error = enclosed_volume(points, flesh.faces) / enclosed_volume(surface.vertices, flesh.faces) - 1.0
    ratios = edge_stretch(surface.vertices, points, unique_edges(flesh.faces))
    parts = surface_parts(covering)
    crossings = [crossing_faces(v, surface.faces) for v in points[: max(_FACES_CHECKED // len(surface.faces), 1)]]
    return PoseQuality(
        loss(points)[0],
        float(np.sqrt((error**2).mean())),
        float(error[np.abs(error).argmax()]),
        Stretch.of(ratios.ravel()),
        sum(len(c.folds(parts).faces) for c in crossings),
        sum(len(c.contact(parts).faces) for c in crossings),
        len(crossings) * len(surface.faces),
    )


class _Variables:
    """All parameters as one vector of numbers near 1: value / scale."""

    def __init__(self, start: Parameters, defaults: Parameters) -> None:
        self._shapes = {f.name: getattr(start, f.name).shape for f in fields(Parameters)}
        self._scale = np.concatenate([np.full(np.prod(s), _SCALES[n]) for n, s in self._shapes.items()])
        values = np.concatenate([getattr(start, n).ravel() for n in self._shapes])
        limits = np.concatenate([np.tile(_BOUNDS[n], (int(np.prod(s)), 1)) for n, s in self._shapes.items()])
        for name in ("inflation", "muscle"):
            rows = np.flatnonzero(
                np.concatenate([np.full(int(np.prod(s)), n == name) for n, s in self._shapes.items()])
            )
            limits[rows, 1] = np.minimum(limits[rows, 1], _MOST * getattr(defaults, name))
        # a start outside the bounds stays where it is: what the animator chose is not taken back
        low, high = np.minimum(limits[:, 0], values), np.maximum(limits[:, 1], values)
        self.start: NDArray[np.float64] = values / self._scale
        self.bounds = np.column_stack([low, high]) / self._scale[:, None]

    def parameters(self, x: NDArray[np.float64]) -> Parameters:
        return Parameters(**self._split(np.clip(x, *self.bounds.T) * self._scale))

    def gradient(self, by_parameter: Parameters) -> NDArray[np.float64]:
        return np.concatenate([getattr(by_parameter, n).ravel() for n in self._shapes]) * self._scale

    def _split(self, values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        cuts = np.cumsum([int(np.prod(s)) for s in self._shapes.values()])[:-1]
        parts = np.split(values, cuts)
        return {n: p.reshape(s) for (n, s), p in zip(self._shapes.items(), parts, strict=True)}
