"""Fit of the parameters to target shapes in given poses: scans, or corrective shapes of another rig.

Positions are linear in the amplitudes, so these solve one bounded linear least squares problem. The parameters that
shape the fields (proximities, peaks, exponents, the palm's exponents) are then optimised by L-BFGS-B with gradients
through the diffusion, and the amplitudes are solved for again.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.amplitudes import LinearDeformation, with_amplitudes
from warpjld.covering.covering import Covering
from warpjld.covering.gradient import Differentiable
from warpjld.covering.parameters import Parameters
from warpjld.errors import InputError
from warpjld.skeleton.kinematics import Poses

__all__ = ["TargetFit", "fit_targets"]

_HIGHEST = 3.0  # upper bound of amplitudes, wide since the target shapes were modelled or scanned
_PULL = 1e-6  # Tikhonov weight, relative to the mean diagonal: keeps amplitudes that the shapes do not determine
_ROUNDS = 4  # rounds of fields and amplitudes in turn
_GAIN = 0.02  # relative decrease of the RMS distance below which a round is discarded
_BOUNDS = {"proximity": (0.05, 0.5), "peak": (0.1, 0.9), "exponents": (0.2, 3.0), "palm": (0.0, 0.5)}  # search bounds


@dataclass(frozen=True, eq=False)
class TargetFit:
    """Result of :func:`fit_targets`.

    Attributes:
        parameters: The best parameters found.
        before: RMS distance from the targets in each pose at the start [m], shape (F,).
        after: The same with ``parameters``.
        farthest: Largest distance [m] before and after.
        seconds: Time taken.
    """

    parameters: Parameters
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    farthest: tuple[float, float]
    seconds: float

    @property
    def rms(self) -> tuple[float, float]:
        """RMS distance over all poses [m], before and after."""
        before, after = (float(np.sqrt((part**2).mean())) for part in (self.before, self.after))
        return before, after


def fit_targets(
    covering: Covering,
    poses: Poses,
    targets: NDArray[np.float64],
    *,
    iterations: int = 10,
    progress: Callable[[str, int, int], None] | None = None,
) -> TargetFit:
    """Fit the parameters of a covering to target shapes.

    Args:
        covering: A bound surface; its parameters are the start, and stay where the targets do not determine them.
        poses: F poses of its skeleton.
        targets: Target positions of its vertices in them [m], shape (F, V, 3).
        iterations: Limit of L-BFGS-B iterations in each round.
        progress: Called with the name of the phase, its steps done, and the number of its steps.

    Raises:
        InputError: Targets of another shape, at a distance larger than the surface itself, or fewer than one iteration.
    """
    if iterations < 1:
        raise InputError(f"iterations: want at least 1, got {iterations}")
    shape = (len(poses), len(covering.surface.vertices), 3)
    if targets.shape != shape or not len(poses):
        raise InputError(f"targets: want shape {shape}, got {targets.shape}")
    report = progress or (lambda what, done, total: None)
    started = time.perf_counter()
    before, far = _distances(covering, poses, targets)
    if before.max() > covering.surface.size:
        raise InputError(
            f"targets: {1e3 * before.max():.4g} mm from a surface of {1e3 * covering.surface.size:.4g} mm: "
            "want metres, in the frame of the rig"
        )
    best = _solved(covering, poses, targets, report)
    after, farthest = _distances(best, poses, targets)
    for _ in range(_ROUNDS):
        other = _solved(_reshaped(best, poses, targets, iterations, report), poses, targets, report)
        reshaped, its_farthest = _distances(other, poses, targets)
        if np.sqrt((reshaped**2).sum()) >= (1.0 - _GAIN) * np.sqrt((after**2).sum()):
            break
        best, after, farthest = other, reshaped, its_farthest
    if (after**2).sum() >= (before**2).sum():
        best, after, farthest = covering, before, far
    return TargetFit(best.parameters, before, after, (far, farthest), time.perf_counter() - started)


def _distances(covering: Covering, poses: Poses, targets: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """RMS distance from the targets in every pose, shape (F,), and the largest distance of all [m]."""
    rms, largest = np.zeros(len(poses)), 0.0
    for start, block in covering.blocks(poses):
        squared = ((block - targets[start : start + len(block)]) ** 2).sum(axis=2)
        rms[start : start + len(block)] = np.sqrt(squared.mean(axis=1))
        largest = max(largest, float(np.sqrt(squared.max())))
    return rms, largest


def _solved(
    covering: Covering, poses: Poses, targets: NDArray[np.float64], report: Callable[[str, int, int], None]
) -> Covering:
    """The covering with the amplitudes of the least squared distance from the targets."""
    from scipy.optimize import lsq_linear

    deformation = LinearDeformation(covering, poses)
    start = deformation.amplitudes
    square, slope = np.zeros((len(start), len(start))), np.zeros(len(start))
    for frame in deformation.frames():
        missing = (targets[frame.number, frame.moved] - frame.points[frame.moved]).ravel()
        square += (frame.directions.T @ frame.directions).toarray()
        slope += frame.directions.T @ missing
        report("amplitudes", frame.number + 1, len(poses))
    moved = np.flatnonzero(np.diag(square) > 1e-12 * np.diag(square).max(initial=0.0))
    if not moved.size:
        return covering
    square = square[np.ix_(moved, moved)]
    square += _PULL * np.diag(square).mean() * np.eye(len(moved))
    lower = np.linalg.cholesky(square)
    high = np.maximum(_HIGHEST, start[moved])
    change = lsq_linear(lower.T, np.linalg.solve(lower, slope[moved]), (-start[moved] - 1e-12, high - start[moved])).x
    amplitudes = start.copy()
    amplitudes[moved] = np.maximum(start[moved] + change, 0.0)
    return covering.with_parameters(with_amplitudes(covering.parameters, amplitudes))


def _reshaped(
    covering: Covering,
    poses: Poses,
    targets: NDArray[np.float64],
    iterations: int,
    report: Callable[[str, int, int], None],
) -> Covering:
    """The covering with field parameters that lessen the squared distance from the targets, at given amplitudes."""
    from scipy.optimize import minimize

    first = covering.parameters
    deformation = Differentiable(covering, poses)
    sizes = {name: getattr(first, name).size for name in _BOUNDS}
    cuts = np.cumsum(list(sizes.values()))[:-1]
    x = np.concatenate([getattr(first, name).ravel() for name in _BOUNDS])
    limits = np.concatenate([np.tile(_BOUNDS[name], (size, 1)) for name, size in sizes.items()])
    bounds = np.column_stack([np.minimum(limits[:, 0], x), np.maximum(limits[:, 1], x)])
    scale = float(((covering.deform(poses) - targets) ** 2).sum())
    done = 0

    def parameters(x: NDArray[np.float64]) -> Parameters:
        values = zip(_BOUNDS, np.split(np.clip(x, *bounds.T), cuts), strict=True)
        return replace(first, **{name: value.reshape(getattr(first, name).shape) for name, value in values})

    def objective(x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        missing = deformation.forward(parameters(x)) - targets
        by = deformation.backward(2.0 * missing / scale).parameters
        return float((missing**2).sum()) / scale, np.concatenate([getattr(by, name).ravel() for name in _BOUNDS])

    def step(_: NDArray[np.float64]) -> None:
        nonlocal done
        done = min(done + 1, iterations)
        report("fields", done, iterations)

    if scale <= (1e-7 * covering.surface.size) ** 2 * targets[..., 0].size:  # exact to single precision
        return covering
    found = minimize(
        objective, x, jac=True, method="L-BFGS-B", bounds=bounds, callback=step, options={"maxiter": iterations}
    )
    return covering.with_parameters(parameters(found.x))
