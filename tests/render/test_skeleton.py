from __future__ import annotations

import numpy as np
import pytest
import trimesh

from warpjld.render.skeleton import bone_faces, bone_vertices, joint_faces, joint_vertices


def test_bones_are_closed_and_reach_from_joint_to_joint() -> None:
    joints = np.random.default_rng(1).normal(size=(5, 3))
    segments = np.array([[0, 1], [1, 2], [0, 3], [3, 4]])
    mesh = trimesh.Trimesh(bone_vertices(joints, segments, 0.01), bone_faces(4), process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0  # outwards
    bones = mesh.vertices.reshape(4, -1, 3)
    np.testing.assert_allclose(bones[:, 0], joints[segments[:, 0]], atol=1e-6)
    np.testing.assert_allclose(bones[:, -1], joints[segments[:, 1]], atol=1e-6)


def test_joints_of_no_length_do_not_break() -> None:
    vertices = bone_vertices(np.zeros((2, 3)), np.array([[0, 1]]), 0.01)
    assert np.isfinite(vertices).all()


def test_joint_balls() -> None:
    centres = np.array([[0.0, 0, 0], [1, 0, 0]])
    mesh = trimesh.Trimesh(joint_vertices(centres, 0.1), joint_faces(2), process=False)
    parts = mesh.split()
    assert len(parts) == 2
    for part in parts:
        assert part.volume == pytest.approx(4 / 3 * np.pi * 1e-3, rel=0.05)
