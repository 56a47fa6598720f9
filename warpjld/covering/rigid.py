"""Rigid vertices of a surface, which follow one bone and are excluded from the operators: eyes, armour, shoes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.operators import Fan
from warpjld.geometry.surface import Surface
from warpjld.skeleton.tree import Skeleton

__all__ = ["domains_of_rigid", "part_of_surface", "without_rigid"]


def domains_of_rigid(rigid: NDArray[np.int32], skeleton: Skeleton, groups: tuple[Fan, ...]) -> NDArray[np.float64]:
    """Operator to which each rigid vertex is assigned, as weights of one and zero, shape (V, fans); rows of flesh are
    zero.

    It is one that begins at the vertex's joint, else, at a tip, the one that ends there, else that of the nearest
    ancestor that has one.
    """
    begins = {s.proximal: f for f, fan in reversed(list(enumerate(groups))) for s in fan.segments}
    ends = {s.distal: f for f, fan in reversed(list(enumerate(groups))) for s in fan.segments}
    out = np.zeros((len(rigid), len(groups)))
    for joint in np.unique(rigid[rigid >= 0]).tolist():
        above = joint
        while above not in begins and above not in ends and skeleton.parents[above] >= 0:
            above = int(skeleton.parents[above])
        out[rigid == joint, begins.get(above, ends.get(above, 0))] = 1.0
    return out


def part_of_surface(
    vertices: NDArray[np.float64], faces: NDArray[np.int32], chosen: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Chosen vertices of a surface, in the order given, and the faces all of whose vertices are chosen."""
    if len(chosen) == len(vertices):
        return vertices, faces
    number = np.full(len(vertices), -1, dtype=np.int32)
    number[chosen] = np.arange(len(chosen), dtype=np.int32)
    numbered = number[faces]
    return vertices[chosen], numbered[(numbered >= 0).all(axis=1)]


def without_rigid(surface: Surface, rigid: NDArray[np.int32]) -> Surface:
    """The surface without faces whose vertices are all rigid; vertices keep their indices."""
    if (rigid < 0).all():
        return surface
    return replace(surface, faces=surface.faces[(rigid[surface.faces] < 0).any(axis=1)])
