"""Calibration: its loss, its result, and that no pose gets worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.benchmarks.skin.measures import dihedral_angles, roughness
from tests.covering.tube import bend, tube, tube_skeleton
from warpjld.covering import Covering, bind
from warpjld.covering.amplitudes import LinearDeformation, amplitudes_of
from warpjld.covering.calibrate import CalibrationStatus, calibrate
from warpjld.covering.calibration_guard import Guard, PoseMeasures
from warpjld.covering.calibration_loss import LossWeights, SurfaceLoss
from warpjld.covering.parameters import Parameters, default_parameters
from warpjld.covering.pose_losses import PoseLosses
from warpjld.covering.pose_sets import calibration_poses, curled, guard_poses
from warpjld.covering.quality import edge_stretch, enclosed_volume, unique_edges
from warpjld.covering.tolerances import Tolerances
from warpjld.errors import InputError
from warpjld.skeleton import CHANNELS, Skeleton
from warpjld.skeleton.kinematics import Poses

SURFACE, SKELETON = tube(rings=21, around=12), tube_skeleton()
POSES = bend(SKELETON, [30.0, 60.0, 90.0])
NONE = POSES[:0]


def with_inflation(skeleton: Skeleton, amount: float) -> Parameters:
    ones = np.ones(len(skeleton))
    return replace(default_parameters(skeleton), inflation=amount * ones, muscle=0.0 * ones, palm=0.0 * ones)


@pytest.fixture(scope="module")
def swollen() -> Covering:
    """Far too much of it."""
    return bind(SKELETON, SURFACE, parameters=with_inflation(SKELETON, 1.2))


@pytest.mark.parametrize("open_end", [False, True])
@pytest.mark.parametrize("only_held", [False, True])
def test_derivatives_of_the_loss(open_end: bool, only_held: bool) -> None:
    surface = replace(SURFACE, faces=SURFACE.faces[:-12]) if open_end else SURFACE
    covering = bind(SKELETON, surface)
    deformation = LinearDeformation(covering, POSES)
    shared = SurfaceLoss(covering.flesh, covering.fields.positions @ SKELETON.rest)
    amplitudes = deformation.amplitudes + 0.3
    direction = np.random.default_rng(3).normal(size=len(amplitudes))
    step = 1e-6 * direction
    for frame in deformation.frames():
        part = shared.pose(frame, deformation.amplitudes, shared.still(frame), only_held=only_held)
        assert part is not None
        here = part.linearised(amplitudes)
        ahead, behind = part.linearised(amplitudes + step), part.linearised(amplitudes - step)
        along = direction[part.parameters]
        for value, slope in (("residuals", here.jacobian), ("constraints", here.slopes)):
            difference = (getattr(ahead, value) - getattr(behind, value)) / 2e-6
            np.testing.assert_allclose(slope @ along, difference, rtol=1e-4, atol=1e-6)
        if only_held:
            assert not len(here.residuals)
        else:
            assert (here.residuals**2).sum() == pytest.approx(part.terms(amplitudes).total)


def test_the_loss_is_what_it_says() -> None:
    """Volume and stretch of a bent tube, summed up by hand."""
    covering = bind(SKELETON, SURFACE)
    deformation = LinearDeformation(covering, POSES)
    shared = SurfaceLoss(SURFACE, covering.fields.positions @ SKELETON.rest, LossWeights(2.0, 3.0, 5.0))
    for frame in deformation.frames():
        part = shared.pose(frame, deformation.amplitudes, shared.still(frame))
        assert part is not None
        moved = np.isin(np.arange(len(SURFACE.vertices)), frame.moved)
        lost = enclosed_volume(frame.points, SURFACE.faces) - enclosed_volume(SURFACE.vertices, SURFACE.faces)
        assert part.before.volume == pytest.approx(2.0 * float(lost / shared.region(frame)) ** 2, rel=1e-4)
        edges = unique_edges(SURFACE.faces)
        edges = edges[moved[edges].any(axis=1)]
        length = np.linalg.norm(SURFACE.vertices[edges[:, 1]] - SURFACE.vertices[edges[:, 0]], axis=1)
        log = np.log(edge_stretch(SURFACE.vertices, frame.points, edges))
        wanted = 3.0 * (length * log**2 * (1.0 + (log / 0.5) ** 2)).sum() / length.sum()
        assert part.before.stretch == pytest.approx(wanted, rel=1e-4)
        # all of a tube that is as long as it is bent lies around its one joint
        assert 0.3 < shared.region(frame) / shared.closed.volume <= 1.1


def test_a_fine_mesh_weighs_as_much_as_a_coarse_one() -> None:
    terms = []
    for rings, around in ((31, 16), (61, 32)):
        covering = bind(SKELETON, tube(rings=rings, around=around))
        part = PoseLosses(covering, POSES[2:], 1).fitted[0]
        terms.append(part.before)
    coarse, fine = terms
    assert fine.stretch == pytest.approx(coarse.stretch, rel=0.35)
    assert fine.roughness == pytest.approx(coarse.roughness, rel=0.35)


def test_a_swollen_tube_gets_its_volume_back(swollen: Covering) -> None:
    """Not to the last: what is lost grows with the square of the angle, inflation with the angle."""
    calls: list[tuple[str, int, int]] = []
    found = calibrate(swollen, POSES, guards=NONE, progress=lambda *c: calls.append(c))
    before, after = (np.sqrt((m.volume**2).mean()) for m in (found.before, found.after))
    assert before > 0.05
    assert after < 0.02
    assert found.loss[1] < found.loss[0]
    assert found.status is CalibrationStatus.CONVERGED
    assert {what for what, _, _ in calls} == {"posing", "measuring", "fitting", "comparing"}
    assert all(0 < done <= total for _, done, total in calls)
    points = swollen.with_parameters(found.parameters).deform(POSES)
    change = enclosed_volume(points, SURFACE.faces) / enclosed_volume(SURFACE.vertices, SURFACE.faces) - 1.0
    np.testing.assert_allclose(found.after.volume, change, atol=1e-6)
    found.parameters.check(SKELETON)


def test_what_it_may_make_worse_decides(swollen: Covering) -> None:
    """From a tube without inflation: as much volume as can be had without more roughness, and more where that is
    allowed."""
    flat = swollen.with_parameters(with_inflation(SKELETON, 0.0))
    nothing = Tolerances(roughness=1.0, roughness_more=0.0)
    strict = calibrate(flat, POSES, guards=NONE, tolerances=nothing)
    free = calibrate(flat, POSES, guards=NONE, tolerances=Tolerances(roughness=10.0, folds=10.0))
    start, kept, regained = (np.abs(m.volume).max() for m in (strict.before, strict.after, free.after))
    assert regained < kept <= start
    assert (strict.after.roughness <= (1.0 + 1e-5) * strict.before.roughness).all()
    assert (free.after.roughness > strict.after.roughness).any()


def test_it_says_when_it_was_stopped(bound: Covering) -> None:
    poses = calibration_poses(bound.skeleton, 6)
    found = calibrate(bound, poses, guards=poses[:0], iterations=2)
    assert found.status is CalibrationStatus.ITERATION_LIMIT
    assert found.evaluations == 2


def test_what_cannot_get_better_stays(swollen: Covering) -> None:
    found = calibrate(swollen, POSES, guards=NONE, iterations=1)
    assert found.status is CalibrationStatus.UNCHANGED
    np.testing.assert_array_equal(found.parameters.inflation, swollen.parameters.inflation)
    first = calibrate(swollen, POSES, guards=NONE)
    again = calibrate(swollen.with_parameters(first.parameters), POSES, guards=NONE)
    assert again.loss[1] <= again.loss[0]


def roughness_of(covering: Covering, poses: Poses) -> list[float]:
    surface = covering.surface
    rest = dihedral_angles(surface.vertices, surface.faces)
    return [roughness(rest, dihedral_angles(p.astype(float), surface.faces)) for p in covering.deform(poses)]


@pytest.mark.parametrize("weights", [LossWeights(), LossWeights(volume=1e6), LossWeights(stretch=1e4)])
def test_no_pose_gets_worse_whatever_is_weighted(bound: Covering, weights: LossWeights) -> None:
    """Volume and roughness by the benchmark's own measures, in poses that are fitted to and in those that are not."""
    found = calibrate(bound, calibration_poses(bound.skeleton, 12), weights=weights)
    other = bound.with_parameters(found.parameters)
    rest = enclosed_volume(bound.surface.vertices, bound.surface.faces)
    for poses in (calibration_poses(bound.skeleton, 12), guard_poses(bound.skeleton)):
        before, after = (
            np.abs(enclosed_volume(c.deform(poses), bound.surface.faces) / rest - 1.0) for c in (bound, other)
        )
        assert (after <= np.maximum(before + 0.002, 0.01)).all()
        rough, now = roughness_of(bound, poses), roughness_of(other, poses)
        assert (np.array(now) <= 1.05 * np.array(rough) + 0.1).all()
    assert (found.after.folds <= 1.02 * found.before.folds + 2).all()


def test_the_guard_measures_and_objects(bound: Covering) -> None:
    poses = curled(bound.skeleton, [0.3, 0.6, 0.9])
    losses = PoseLosses(bound, poses, 3)
    guard = Guard(bound, poses, losses)
    np.testing.assert_allclose(np.degrees(guard.first.roughness), roughness_of(bound, poses), rtol=1e-6)
    rest = enclosed_volume(bound.surface.vertices, bound.surface.faces)
    volume = enclosed_volume(bound.deform(poses), bound.surface.faces) / rest - 1.0
    np.testing.assert_allclose(guard.first.volume, volume, atol=1e-9)
    again = PoseMeasures.of_none(3)
    guard.measure(bound, np.arange(3), again)
    assert not np.any(guard.worse(again))
    swollen = bound.with_parameters(replace(bound.parameters, inflation=4.0 * bound.parameters.inflation + 0.5))
    guard.measure(swollen, np.arange(3), again)
    emptier, _, rougher = guard.worse(again)
    assert emptier.all()
    assert rougher.all()
    np.testing.assert_allclose(np.degrees(again.roughness), roughness_of(swollen, poses), rtol=1e-6)
    summary = again.summary()
    assert summary["roughness_worst"] == pytest.approx(max(roughness_of(swollen, poses)))


def test_bad_arguments(swollen: Covering, bound: Covering) -> None:
    with pytest.raises(InputError, match="iterations: want at least 1"):
        calibrate(swollen, POSES, iterations=0)
    with pytest.raises(InputError, match="at least one"):
        calibrate(swollen, POSES[:0])
    with pytest.raises(InputError, match="want 3 joints, got 26"):
        calibrate(swollen, POSES, guards=curled(bound.skeleton, [0.5]))
    with pytest.raises(InputError, match="none of its joints may flex"):
        calibration_poses(replace(SKELETON, limits=np.zeros_like(SKELETON.limits)))
    with pytest.raises(InputError, match="at least 1 pose"):
        calibration_poses(SKELETON, 0)


def test_pose_set_of_a_hand(bound: Covering) -> None:
    skeleton = bound.skeleton
    poses, guards = calibration_poses(skeleton), guard_poses(skeleton)
    flexion = CHANNELS.index("flexion")
    # where abduction comes in, the vertical component (R29) of a thumb may exceed its flexion
    for part in (poses.flexion[:5], poses.flexion[-20:]):
        assert (part <= skeleton.limits[:, flexion, 1] + 1e-6).all()
    for j, name in enumerate(skeleton.names):
        bends = skeleton.limits[j, flexion, 1] > 0.0 and skeleton.parents[j] >= 0 and len(skeleton.children[j])
        for some in (poses, guards):
            assert (np.abs(some.flexion[:, j]).max() > 0.1) == bool(bends), name
    np.testing.assert_array_equal(guards.rotations, guard_poses(skeleton).rotations)
    np.testing.assert_allclose(poses.rotations[:3], curled(skeleton, [0.3, 0.6, 0.9]).rotations)
    assert len(calibration_poses(skeleton, 12)) == 12


def test_half_a_curl(bound: Covering) -> None:
    flexion = np.degrees(curled(bound.skeleton, [0.5]).flexion[0])
    assert flexion[bound.skeleton.index("middle.knuckle2")] == pytest.approx(48.5)
    assert flexion[bound.skeleton.index("thumb.knuckle2")] == pytest.approx(0.0, abs=1e-9)


def test_amplitudes_alone_change(swollen: Covering) -> None:
    found = calibrate(swollen, POSES, guards=NONE)
    assert found.parameters.shapes_like(swollen.parameters)
    assert amplitudes_of(found.parameters).max() <= 1.2 + 1e-12
