"""Rigid objects as contact obstacles: exact for built-in shapes, with rounded edges."""

from __future__ import annotations

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.meshes import RigidMesh
from warpjld.fem.contact.obstacles.obstacle import RigidMotion
from warpjld.fem.contact.obstacles.solids import Box, Cylinder, Sphere
from warpjld.grasp import GraspObject

__all__ = ["rigid_obstacle"]

_ROUNDED = 1e-3
"""Radius to which contact rounds the edges of boxes and cylinders [m], chosen because skin cannot bend around a sharp
edge."""


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
