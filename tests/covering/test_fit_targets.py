"""Parameters found again from the shapes that they make."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.covering.tube import bend, tube, tube_skeleton
from warpjld.covering import Covering, bind
from warpjld.covering.fit_targets import fit_targets
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.pose_sets import calibration_poses
from warpjld.errors import InputError

SURFACE, SKELETON = tube(rings=21, around=12), tube_skeleton()
POSES = bend(SKELETON, [30.0, 60.0, 90.0])
NOISE = 2e-4  # metres, of each coordinate


def other(parameters: Parameters, seed: int, *, shapes: bool = False) -> Parameters:
    rng = np.random.default_rng(seed)
    count = len(parameters.inflation)
    made = replace(parameters, inflation=rng.uniform(0.0, 1.5, count), muscle=rng.uniform(0.0, 1.0, count))
    if shapes:
        made = replace(made, proximity=rng.uniform(0.15, 0.5, (count, 2)))
    return made


def targets_of(covering: Covering, parameters: Parameters, poses) -> np.ndarray:
    return covering.with_parameters(parameters).deform(poses).astype(np.float64)


def test_amplitudes_are_found_again(bound: Covering) -> None:
    poses = calibration_poses(bound.skeleton)
    wanted = other(bound.parameters, 4)
    found = fit_targets(bound, poses, targets_of(bound, wanted, poses))
    assert found.rms[0] > 1e-4
    assert found.rms[1] < 1e-7
    assert found.farthest[1] < 1e-6
    # where shapes determine them: joints that bend, and swell enough to be seen
    moves = [j for j, name in enumerate(bound.skeleton.names) if "knuckle" in name]
    np.testing.assert_allclose(found.parameters.inflation[moves], wanted.inflation[moves], atol=2e-3)
    np.testing.assert_allclose(found.parameters.muscle[moves], wanted.muscle[moves], atol=2e-3)


def test_through_noise(bound: Covering) -> None:
    poses = calibration_poses(bound.skeleton)
    wanted = other(bound.parameters, 5)
    exact = targets_of(bound, wanted, poses)
    noisy = exact + NOISE * np.random.default_rng(6).normal(size=exact.shape)
    found = fit_targets(bound, poses, noisy, iterations=3)
    assert found.rms[1] == pytest.approx(np.sqrt(3.0) * NOISE, rel=0.02)
    fitted = targets_of(bound, found.parameters, poses)
    assert np.sqrt(((fitted - exact) ** 2).sum(axis=2).mean()) < 0.1 * NOISE


def test_what_shapes_the_fields_is_found_too() -> None:
    covering = bind(SKELETON, SURFACE)
    wanted = other(covering.parameters, 7, shapes=True)
    targets = targets_of(covering, wanted, POSES)
    amplitudes = replace(wanted, proximity=covering.parameters.proximity)
    known = np.sqrt(((targets_of(covering, amplitudes, POSES) - targets) ** 2).sum(axis=2).mean())
    found = fit_targets(covering, POSES, targets, iterations=40)
    assert found.rms[1] < 0.2 * known, "nearer than with the right amplitudes alone"
    found.parameters.check(SKELETON)
    again = targets_of(covering, found.parameters, POSES)
    np.testing.assert_allclose(found.after, np.sqrt(((again - targets) ** 2).sum(axis=2).mean(axis=1)), rtol=1e-6)


def test_nothing_better_than_the_start() -> None:
    covering = bind(SKELETON, SURFACE)
    found = fit_targets(covering, POSES, targets_of(covering, covering.parameters, POSES))
    np.testing.assert_allclose(found.parameters.inflation, covering.parameters.inflation, atol=1e-3)
    assert found.rms[1] <= found.rms[0] < 1e-9


def test_shapes_that_no_parameter_makes_are_told_by_their_distance() -> None:
    covering = bind(SKELETON, SURFACE, parameters=default_parameters(SKELETON))
    shifted = targets_of(covering, covering.parameters, POSES) + np.array([0.0, 0.004, 0.0])
    found = fit_targets(covering, POSES, shifted, iterations=3)
    assert 1e-3 < found.rms[1] <= found.rms[0] == pytest.approx(4e-3, rel=1e-3)


def test_bad_arguments() -> None:
    covering = bind(SKELETON, SURFACE)
    targets = targets_of(covering, covering.parameters, POSES)
    with pytest.raises(InputError, match="iterations: want at least 1"):
        fit_targets(covering, POSES, targets, iterations=0)
    with pytest.raises(InputError, match=r"targets: want shape \(3, "):
        fit_targets(covering, POSES, targets[:2])
    with pytest.raises(InputError, match="want metres"):
        fit_targets(covering, POSES, 1e3 * targets)
