"""Calibration: its gradient, its result, and that it is never worse than the start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.covering.tube import bend, tube, tube_skeleton
from warpjld.covering import Covering, bind
from warpjld.covering.calibrate import CalibrationStatus, calibrate
from warpjld.covering.calibration_loss import DeformationLoss, LossWeights
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.pose_sets import calibration_poses, curled
from warpjld.covering.quality import edge_stretch, enclosed_volume, unique_edges
from warpjld.errors import InputError
from warpjld.skeleton import CHANNELS, Skeleton

SURFACE, SKELETON = tube(rings=21, around=12), tube_skeleton()
POSES = bend(SKELETON, [30.0, 60.0, 90.0])


def without_inflation(skeleton: Skeleton) -> Parameters:
    zero = np.zeros(len(skeleton))
    return replace(default_parameters(skeleton), inflation=zero, muscle=zero, palm=zero)


@pytest.fixture(scope="module")
def flat() -> Covering:
    return bind(SKELETON, SURFACE, parameters=without_inflation(SKELETON))


@pytest.mark.parametrize("open_end", [False, True])
@pytest.mark.parametrize(
    "weights", [LossWeights(1.0, 0.0, 0.0), LossWeights(0.0, 1.0, 0.0), LossWeights(0.0, 0.0, 1.0)]
)
def test_loss_gradient(weights: LossWeights, open_end: bool) -> None:
    surface = replace(SURFACE, faces=SURFACE.faces[:-12]) if open_end else SURFACE
    rng = np.random.default_rng(3)
    points = SURFACE.vertices + 5e-4 * rng.normal(size=(2, *SURFACE.vertices.shape))
    loss = DeformationLoss(surface, weights)
    slope = loss(points)[1]
    direction = rng.normal(size=points.shape)
    step = 1e-8
    difference = (loss(points + step * direction)[0] - loss(points - step * direction)[0]) / (2.0 * step)
    assert (slope * direction).sum() == pytest.approx(difference, rel=1e-5)


def test_loss_is_what_it_says() -> None:
    points = SURFACE.vertices[None] * 1.1
    assert DeformationLoss(SURFACE, LossWeights(1.0, 0.0, 0.0))(points)[0] == pytest.approx((1.1**3 - 1.0) ** 2)
    assert DeformationLoss(SURFACE, LossWeights(0.0, 1.0, 0.0))(points)[0] == pytest.approx(np.log(1.1) ** 2)
    assert DeformationLoss(SURFACE, LossWeights(0.0, 0.0, 1.0))(points)[0] == pytest.approx(np.log(1.1) ** 2)
    at_rest, slope = DeformationLoss(SURFACE)(SURFACE.vertices[None])
    assert at_rest == pytest.approx(0.0, abs=1e-12), "the volume of a rest pose is summed in another order"
    np.testing.assert_allclose(slope, 0.0, atol=1e-9)


def test_a_tube_without_inflation_gets_its_volume_back(flat: Covering) -> None:
    calls: list[tuple[str, int, int]] = []
    found = calibrate(flat, POSES, iterations=60, progress=lambda *c: calls.append(c))
    assert found.before.volume_mean > 0.03
    assert found.after.volume_mean < 0.015
    assert found.after.score < found.before.score
    assert found.after.stretch.smallest >= found.before.stretch.smallest
    assert found.iterations == len(calls) <= 60
    assert calls[-1] == ("calibrating", found.iterations, 60)
    points = flat.with_parameters(found.parameters).deform(POSES)
    change = enclosed_volume(points, SURFACE.faces) / enclosed_volume(SURFACE.vertices, SURFACE.faces) - 1.0
    assert np.sqrt((change**2).mean()) == pytest.approx(found.after.volume_mean)
    found.parameters.check(SKELETON)


def test_it_says_when_it_was_stopped(flat: Covering) -> None:
    assert calibrate(flat, POSES, iterations=1).status is CalibrationStatus.ITERATION_LIMIT


def test_never_worse_than_the_start(flat: Covering) -> None:
    first = calibrate(flat, POSES, iterations=60)
    again = calibrate(flat.with_parameters(first.parameters), POSES, iterations=5)
    assert again.after.score <= first.after.score + 1e-12
    if again.status is CalibrationStatus.UNCHANGED:
        assert again.parameters is not None
        np.testing.assert_array_equal(again.parameters.inflation, first.parameters.inflation)


def test_bad_arguments(flat: Covering) -> None:
    with pytest.raises(InputError, match="iterations: want at least 1"):
        calibrate(flat, POSES, iterations=0)
    with pytest.raises(InputError, match="at least one"):
        calibrate(flat, POSES[:0])
    with pytest.raises(InputError, match="none of its joints may flex"):
        calibration_poses(replace(SKELETON, limits=np.zeros_like(SKELETON.limits)))
    with pytest.raises(InputError, match="at least 1 pose"):
        calibration_poses(SKELETON, 0)


def test_pose_set_of_a_hand(bound: Covering) -> None:
    skeleton = bound.skeleton
    poses = calibration_poses(skeleton)
    flexion = CHANNELS.index("flexion")
    # where abduction comes in, the vertical component (R29) of a thumb may exceed its flexion
    for part in (poses.flexion[:5], poses.flexion[-20:]):
        assert (part <= skeleton.limits[:, flexion, 1] + 1e-6).all()
    for j, name in enumerate(skeleton.names):
        bends = skeleton.limits[j, flexion, 1] > 0.0 and skeleton.parents[j] >= 0 and len(skeleton.children[j])
        assert (np.abs(poses.flexion[:, j]).max() > 0.1) == bool(bends), name
    np.testing.assert_array_equal(poses.rotations, calibration_poses(skeleton).rotations)
    np.testing.assert_allclose(poses.rotations[:3], curled(skeleton, [0.3, 0.6, 0.9]).rotations)
    assert len(calibration_poses(skeleton, 12)) == 12


def test_half_a_curl(bound: Covering) -> None:
    flexion = np.degrees(curled(bound.skeleton, [0.5]).flexion[0])
    assert flexion[bound.skeleton.index("middle.knuckle2")] == pytest.approx(48.5)
    assert flexion[bound.skeleton.index("thumb.knuckle2")] == pytest.approx(0.0, abs=1e-9)


def test_stretch_of_the_loss_is_that_of_the_measure() -> None:
    points = SURFACE.vertices * [1.0, 1.0, 1.5]
    edges = unique_edges(SURFACE.faces)
    length = np.linalg.norm(SURFACE.vertices[edges[:, 1]] - SURFACE.vertices[edges[:, 0]], axis=1)
    ratio = edge_stretch(SURFACE.vertices, points, edges)
    expected = (length * np.log(ratio) ** 2).sum() / length.sum()
    assert DeformationLoss(SURFACE, LossWeights(0.0, 1.0, 0.0))(points[None])[0] == pytest.approx(expected)
