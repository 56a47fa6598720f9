"""Rigid objects as contact obstacles: exact for built-in shapes, with rounded edges."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.meshes import RigidMesh
from warpjld.fem.contact.obstacles.obstacle import RigidMotion
from warpjld.fem.contact.obstacles.solids import Box, Cylinder, Sphere
from warpjld.grasp import GraspObject, Places

__all__ = ["placed_motion", "rigid_obstacle"]

_ROUNDED = 1e-3
"""Radius to which contact rounds the edges of boxes and cylinders [m], chosen because skin cannot bend around a sharp
edge."""


def placed_motion(place: Callable[[float], Places], start: float) -> RigidMotion:
    """Motion of an obstacle that follows a placement by frame number; its times are in frames from ``start``."""

    def motion(time: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        here = place(start + time)
        return here.position[0], here.rotation[0]

    return motion


def rigid_obstacle(thing: GraspObject, motion: RigidMotion) -> Obstacle:
    """Obstacle for a rigid object with a motion: analytic for balls, boxes and cylinders, a mesh otherwise."""
    middle = 0.5 * (thing.vertices.min(axis=0) + thing.vertices.max(axis=0))
    edge = min(_ROUNDED, 0.2 * float(thing.size.min()))
    if thing.origin == "ball":
        return Sphere(middle, 0.5 * float(thing.size.max()), motion)
    if thing.origin == "box":
        return Box(thing.size, middle, edge, motion)
    if thing.origin == "cylinder":
        return Cylinder(0.5 * float(thing.size[0]), float(thing.size[1]), middle, edge=edge, motion=motion)
    return RigidMesh(thing.vertices, thing.faces, motion)
