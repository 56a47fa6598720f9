"""Meshes of segments and joints with constant topology, so that in a film only their vertices change."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

__all__ = ["bone_faces", "bone_vertices", "joint_faces", "joint_vertices"]

_SIDES = 8  # sides of a bone's double cone
_COLLAR = 0.16  # position of its largest radius, as a share of its length


def bone_vertices(joints: NDArray[np.floating], segments: NDArray[np.integer], thickness: float) -> NDArray[np.float32]:
    """Vertices of slender double cones from joint to joint, the usual display of bones in animation software.

    Args:
        joints: Joint positions [m], shape (J, 3).
        segments: Proximal and distal joint of each bone, shape (B, 2).
        thickness: Largest radius [m]; short bones are thinner.

    Returns:
        Positions, shape (B · (sides + 2), 3), for `bone_faces`.
    """
    start, end = joints[segments[:, 0]].astype(float), joints[segments[:, 1]].astype(float)
    axis = end - start
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis /= np.maximum(length, 1e-12)
    # the coordinate axis most perpendicular to the bone gives a stable perpendicular direction
    least = np.eye(3)[np.abs(axis).argmin(axis=1)]
    across = np.cross(axis, least)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    other = np.cross(axis, across)
    radius = np.minimum(thickness, 0.2 * length)
    turn = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.cos(turn)[:, None] * across[:, None] + np.sin(turn)[:, None] * other[:, None]
    collar = (start + _COLLAR * length * axis)[:, None] + radius[:, None] * ring
    return np.concatenate([start[:, None], collar, end[:, None]], axis=1).reshape(-1, 3).astype(np.float32)


def bone_faces(bones: int) -> NDArray[np.int32]:
    """Triangles over `bone_vertices`."""
    around = np.arange(_SIDES)
    following = (around + 1) % _SIDES
    lower = np.stack([np.zeros(_SIDES, int), 1 + following, 1 + around], axis=1)
    upper = np.stack([np.full(_SIDES, _SIDES + 1), 1 + around, 1 + following], axis=1)
    single = np.concatenate([lower, upper])
    return (single + (_SIDES + 2) * np.arange(bones)[:, None, None]).reshape(-1, 3).astype(np.int32)


def joint_vertices(joints: NDArray[np.floating], radius: float) -> NDArray[np.float32]:
    """Vertices of spheres around joints [m], shape (J · n, 3), for `joint_faces`."""
    ball, _ = _ball()
    return (joints[:, None].astype(float) + radius * ball).reshape(-1, 3).astype(np.float32)


def joint_faces(joints: int) -> NDArray[np.int32]:
    """Triangles over `joint_vertices`."""
    ball, faces = _ball()
    return (faces + len(ball) * np.arange(joints)[:, None, None]).reshape(-1, 3).astype(np.int32)


@lru_cache(maxsize=1)
def _ball() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and faces of a unit sphere."""
    import trimesh

    sphere = trimesh.creation.icosphere(subdivisions=2)
    return np.array(sphere.vertices), np.array(sphere.faces)
