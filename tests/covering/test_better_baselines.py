"""Optimised centres of rotation and direct delta mush."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.covering.tube import AROUND, RADIUS, bend, tube, tube_skeleton
from warpjld.covering.baselines import linear_blend_skinning
from warpjld.covering.centres_of_rotation import centre_of_rotation_skinning, centres_of_rotation
from warpjld.covering.delta_mush import delta_mush_moments, direct_delta_mush
from warpjld.rig import Skin
from warpjld.skeleton import CHANNELS, Poses, poses_from_angles, rest_poses

SURFACE, SKELETON = tube(), tube_skeleton()
REST = np.asarray(SURFACE.vertices, dtype=np.float64)
_AT = np.clip((-0.02 - REST[:, 2]) / 0.02, 0.0, 1.0)
SOFT = Skin(np.tile(np.array([0, 1], dtype=np.int32), (len(_AT), 1)), np.column_stack([1.0 - _AT, _AT]))
ONE = Skin(np.zeros((len(REST), 1), dtype=np.int32), np.ones((len(REST), 1)))

Skinning = Callable[[Skin, Poses], np.ndarray]


def by_centres(skin: Skin, poses: Poses) -> np.ndarray:
    return centre_of_rotation_skinning(SKELETON, REST, skin, centres_of_rotation(REST, SURFACE.faces, skin), poses)


def by_mush(skin: Skin, poses: Poses) -> np.ndarray:
    return direct_delta_mush(SKELETON, REST, delta_mush_moments(REST, SURFACE.faces, skin, len(SKELETON)), poses)


METHODS = pytest.mark.parametrize("skinning", [by_centres, by_mush])


@METHODS
def test_rest_is_kept(skinning: Skinning) -> None:
    np.testing.assert_allclose(skinning(SOFT, rest_poses(SKELETON))[0], REST, atol=1e-10)


@METHODS
def test_a_moved_whole_stays_rigid(skinning: Skinning) -> None:
    turn = Rotation.from_rotvec([0.4, -1.1, 2.0])
    zero = np.zeros((1, len(SKELETON), len(CHANNELS)))
    move = np.array([[0.3, -0.2, 0.5]])
    poses = poses_from_angles(SKELETON, zero, root_position=move, root_rotation=turn.as_quat()[None])
    wanted = turn.apply(REST - SKELETON.rest[0]) + poses.positions[0, 0]
    # moments of joints below 1e-9 are dropped
    np.testing.assert_allclose(skinning(SOFT, poses)[0], wanted, atol=1e-8)


@METHODS
def test_one_joint_is_linear_blending(skinning: Skinning) -> None:
    poses = bend(SKELETON, [70.0])
    wanted = linear_blend_skinning(SKELETON, REST, ONE, poses)
    np.testing.assert_allclose(skinning(ONE, poses), wanted, atol=1e-10)


def test_centres_of_a_straight_tube_lie_on_its_axis_and_a_twist_keeps_its_radius() -> None:
    """Linear blending narrows the middle of a twist by cos(θ/2)."""
    blended = np.flatnonzero((_AT > 0.0) & (_AT < 1.0))
    axis = REST[:AROUND, :2].mean(axis=0)
    centres = centres_of_rotation(REST, SURFACE.faces, SOFT)
    np.testing.assert_allclose(centres[blended, :2], np.tile(axis, (len(blended), 1)), atol=0.02 * RADIUS)
    angles = np.zeros((1, len(SKELETON), len(CHANNELS)))
    angles[0, 1, CHANNELS.index("twisting")] = np.radians(120.0)
    poses = poses_from_angles(SKELETON, angles)
    radius = np.linalg.norm(by_centres(SOFT, poses)[0, blended, :2] - axis, axis=1)
    np.testing.assert_allclose(radius, RADIUS, rtol=0.05)
    thin = linear_blend_skinning(SKELETON, REST, SOFT, poses)[0, blended, :2]
    assert np.linalg.norm(thin - axis, axis=1).min() < 0.55 * RADIUS


def test_similar_weights_make_a_centre() -> None:
    """Against the plain double sum of the paper's equation."""
    skin = SOFT
    weights = np.zeros((len(REST), 2))
    weights[np.arange(len(REST))[:, None], skin.joints] = skin.weights
    corners = REST[SURFACE.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    b = weights[SURFACE.faces].mean(axis=1)
    centres = centres_of_rotation(REST, SURFACE.faces, skin)
    for v in np.flatnonzero((_AT > 0.1) & (_AT < 0.9))[::17]:
        a = weights[v]
        alike = sum(
            a[j] * a[k] * b[:, j] * b[:, k] * np.exp(-((a[j] * b[:, k] - a[k] * b[:, j]) ** 2) / 0.01)
            for j in range(2)
            for k in range(2)
            if j != k
        )
        wanted = (alike * area) @ corners.mean(axis=1) / (alike @ area)
        np.testing.assert_allclose(centres[v], wanted, atol=1e-12)


def test_mush_smooths_what_linear_blending_of_hard_weights_tears() -> None:
    """One joint a vertex: linear blending stretches the row of edges at the border, delta mush spreads it."""
    hard = Skin((REST[:, 2:] < -0.03).astype(np.int32), np.ones((len(REST), 1)))
    poses = bend(SKELETON, [60.0])
    edges = np.unique(np.sort(SURFACE.faces[:, :2], axis=1), axis=0)
    before = np.linalg.norm(REST[edges[:, 0]] - REST[edges[:, 1]], axis=1)

    def largest(points: np.ndarray) -> float:
        return float((np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1) / before).max())

    assert largest(by_mush(hard, poses)[0]) < 0.5 * largest(linear_blend_skinning(SKELETON, REST, hard, poses)[0])
