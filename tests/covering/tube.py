"""A tube with a joint in the middle: the smallest surface whose deformation has known right answers."""

from __future__ import annotations

import numpy as np

from warpjld.geometry.surface import Surface, weld_surface
from warpjld.skeleton import CHANNELS, Poses, Skeleton, poses_from_angles

SEGMENT = 0.03
RADIUS = 0.008
AROUND = 32


def tube(rings: int = 61, around: int = AROUND, radius: float = RADIUS, segment: float = SEGMENT) -> Surface:
    """A closed tube along -z of two segments, with flat caps; vertex ``ring * around + k`` lies on a ring."""
    angle = 2.0 * np.pi * np.arange(around) / around
    circle = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(around)])
    along = np.linspace(0.0, -2.0 * segment, rings)
    points = [radius * circle + [0.0, 0.0, z] for z in along]
    k, after = np.arange(around), (np.arange(around) + 1) % around
    faces = [
        np.concatenate([np.column_stack([a + k, b + k, b + after]), np.column_stack([a + k, b + after, a + after])])
        for a, b in zip(range(0, (rings - 1) * around, around), range(around, rings * around, around), strict=True)
    ]
    start, last = rings * around, (rings - 1) * around
    caps = [np.column_stack([np.full(around, start), k, after])]
    caps += [np.column_stack([np.full(around, start + 1), last + after, last + k])]
    points += [np.array([[0.0, 0.0, along[0]], [0.0, 0.0, along[-1]]])]
    return weld_surface(np.concatenate(points), np.concatenate([*faces, *caps]))


def tube_skeleton(limit: float = 90.0, segment: float = SEGMENT) -> Skeleton:
    """Root, a joint that flexes to ``limit`` degrees, and a tip; the external side is +y."""
    limits = np.zeros((3, len(CHANNELS), 2))
    limits[1, CHANNELS.index("flexion")] = np.radians([-45.0, limit])
    rest = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -segment], [0.0, 0.0, -2.0 * segment]])
    parents = np.array([-1, 0, 1], dtype=np.int32)
    return Skeleton(("tube.start", "tube.joint", "tube.end"), parents, rest, np.tile([-1.0, 0.0, 0.0], (3, 1)), limits)


def bend(skeleton: Skeleton, degrees: list[float]) -> Poses:
    """The joint flexed by some angles, one a frame."""
    angles = np.zeros((len(degrees), 3, len(CHANNELS)))
    angles[:, 1, CHANNELS.index("flexion")] = np.radians(degrees)
    return poses_from_angles(skeleton, angles)
