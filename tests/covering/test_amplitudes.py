"""The deformation as a linear function of amplitudes, beside the kernels; volume as a quadratic one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.covering.tube import bend, tube, tube_skeleton
from warpjld.covering import Covering, bind
from warpjld.covering.amplitudes import LinearDeformation, amplitudes_of, with_amplitudes
from warpjld.covering.pose_sets import calibration_poses, guard_poses
from warpjld.covering.quality import enclosed_volume
from warpjld.covering.volume_form import ClosedSurface, VolumeForm, any_of
from warpjld.geometry.surface import Surface
from warpjld.rig import Rig


@pytest.fixture(scope="module")
def hand(built: Rig) -> Covering:
    return bind(built.skeleton, built.surface)


def other_amplitudes(covering: Covering) -> np.ndarray:
    return np.random.default_rng(2).uniform(0.0, 0.8, len(amplitudes_of(covering.parameters)))


def test_it_is_what_the_kernels_give(hand: Covering) -> None:
    poses = guard_poses(hand.skeleton)
    amplitudes = other_amplitudes(hand)
    wanted = hand.with_parameters(with_amplitudes(hand.parameters, amplitudes)).deform(poses)
    deformation = LinearDeformation(hand, poses)
    change = amplitudes - deformation.amplitudes
    moved = 0
    for frame in deformation.frames():
        points = frame.points.astype(np.float64)
        points[frame.moved] += (frame.directions @ change).reshape(-1, 3)
        np.testing.assert_allclose(points, wanted[frame.number], atol=2e-6 * hand.surface.size)
        moved += len(frame.moved)
    assert moved > len(hand.surface.vertices)
    assert frame.number == len(poses) - 1


def test_a_joint_at_rest_moves_nothing(hand: Covering) -> None:
    from warpjld.skeleton.kinematics import rest_poses

    frame = next(LinearDeformation(hand, rest_poses(hand.skeleton)).frames())
    assert not len(frame.moved)
    assert frame.directions.shape == (0, 2 * len(hand.skeleton))


@pytest.mark.parametrize("open_end", [False, True])
def test_volume_form(open_end: bool) -> None:
    skeleton, surface = tube_skeleton(), tube(rings=21, around=12)
    if open_end:
        surface = replace(surface, faces=surface.faces[:-12])
    check_volume(bind(skeleton, surface), surface, bend(skeleton, [30.0, 60.0, 90.0]))


def test_volume_form_of_a_hand(hand: Covering) -> None:
    check_volume(hand, hand.flesh, calibration_poses(hand.skeleton, 8))


def check_volume(covering: Covering, surface: Surface, poses) -> None:
    closed = ClosedSurface(surface)
    assert closed.volume == pytest.approx(float(enclosed_volume(surface.vertices, surface.faces)))
    deformation = LinearDeformation(covering, poses)
    amplitudes = other_amplitudes(covering)
    change = amplitudes - deformation.amplitudes
    wanted = covering.with_parameters(with_amplitudes(covering.parameters, amplitudes)).deform(poses)
    for frame in deformation.frames():
        points = frame.points.astype(np.float64)
        form = VolumeForm.of(closed, points, frame.moved, frame.directions)
        volume = float(enclosed_volume(points, surface.faces))
        assert form.constant == pytest.approx(volume - closed.volume, abs=1e-9 * closed.volume)
        now = float(enclosed_volume(wanted[frame.number], surface.faces)) - volume
        assert form.lost(change)[0] - form.constant == pytest.approx(now, rel=0.01, abs=2e-5 * closed.volume)
        step = 1e-4 * np.random.default_rng(frame.number).normal(size=len(change))
        ahead, behind = form.lost(change + step)[0], form.lost(change - step)[0]
        assert form.lost(change)[1] @ step == pytest.approx((ahead - behind) / 2.0, rel=1e-6, abs=1e-18)


def test_any_of() -> None:
    chosen = np.array([False, True, False, False])
    corners = np.array([[0, 2, 3], [3, 2, 1], [1, 0, 0]])
    np.testing.assert_array_equal(any_of(chosen, corners), chosen[corners].any(axis=1))
