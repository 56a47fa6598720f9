"""Linear blend and dual quaternion skinning."""

from __future__ import annotations

import numpy as np
import pytest

from tests.covering.tube import AROUND, RADIUS, bend, tube, tube_skeleton
from warpjld.covering.baselines import dual_quaternion_skinning, linear_blend_skinning
from warpjld.rig import Skin
from warpjld.skeleton import rest_poses

SURFACE, SKELETON = tube(), tube_skeleton()
_AT = np.clip((-0.02 - SURFACE.vertices[:, 2]) / 0.02, 0.0, 1.0)
SKIN = Skin(np.tile(np.array([0, 1], dtype=np.int32), (len(_AT), 1)), np.column_stack([1.0 - _AT, _AT]))
METHODS = pytest.mark.parametrize("skinning", [linear_blend_skinning, dual_quaternion_skinning])


@METHODS
def test_rest_is_kept(skinning) -> None:
    moved = skinning(SKELETON, SURFACE.vertices, SKIN, rest_poses(SKELETON))
    np.testing.assert_allclose(moved[0], SURFACE.vertices, atol=1e-15)


@METHODS
def test_vertices_of_one_bone_move_rigidly(skinning) -> None:
    poses = bend(SKELETON, [70.0])
    moved = skinning(SKELETON, SURFACE.vertices, SKIN, poses)[0]
    last = SURFACE.vertices[:, 2] < -0.045
    to_tip = np.linalg.norm(SURFACE.vertices[last] - SKELETON.rest[2], axis=1)
    np.testing.assert_allclose(np.linalg.norm(moved[last] - poses.positions[0, 2], axis=1), to_tip, atol=1e-12)


def test_the_joint_of_a_tube() -> None:
    """LBS shrinks the joint's section by cos(θ/2); a dual quaternion keeps its thickness (Kavan 2007, Fig. 3)."""
    poses = bend(SKELETON, [90.0])
    ring = slice(30 * AROUND, 31 * AROUND)
    joint = poses.positions[0, 1]
    spread = {
        method: np.linalg.norm(method(SKELETON, SURFACE.vertices, SKIN, poses)[0, ring] - joint, axis=1)
        for method in (linear_blend_skinning, dual_quaternion_skinning)
    }
    assert spread[linear_blend_skinning].min() == pytest.approx(RADIUS * np.cos(np.pi / 4.0), rel=1e-9)
    np.testing.assert_allclose(spread[dual_quaternion_skinning], RADIUS, rtol=1e-9)
