"""A finger-like capsule that bends, with two segments inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
import trimesh


@dataclass(frozen=True, eq=False)
class Finger:
    faces: np.ndarray
    frames: np.ndarray  # (F, V, 3)
    joints: np.ndarray  # (F, 3, 3)
    segments: np.ndarray


@pytest.fixture(scope="session")
def finger() -> Finger:
    mesh = trimesh.creation.capsule(height=0.08, radius=0.012, count=[16, 16])
    rest = np.array(mesh.vertices)[:, [0, 2, 1]] * [1, 1, -1]  # along Y
    bones = np.array([[0, 0, 0], [0, 0.04, 0], [0, 0.08, 0]], float)
    frames, joints = [], []
    for bend in np.linspace(0, 1.2, 6):
        frames.append(_bent(rest, bend))
        joints.append(_bent(bones, bend))
    return Finger(np.array(mesh.faces), np.stack(frames), np.stack(joints), np.array([[0, 1], [1, 2]]))


def _bent(points: np.ndarray, angle: float) -> np.ndarray:
    share = np.clip((points[:, 1] - 0.03) / 0.02, 0, 1) * angle
    x, y, z = points.T
    y = y - 0.04
    turned = np.stack([x, np.cos(share) * y - np.sin(share) * z, np.sin(share) * y + np.cos(share) * z], axis=1)
    return turned + np.array([0, 0.04, 0])
