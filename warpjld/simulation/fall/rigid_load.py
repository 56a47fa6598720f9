"""External loads of an object as force and moment on a rigid body (B eqs. 1–4, R97)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp import GraspObject
from warpjld.simulation.fall.rigid_body import RigidBody
from warpjld.simulation.object_loads import ObjectLoad, ObjectSpin
from warpjld.simulation.specification import ContactSpecification

__all__ = ["RigidLoad", "rigid_load"]

_ACROSS = 20.0
"""Edges across an object's largest extent, by which the points of loads are found."""


@dataclass(frozen=True, eq=False)
class _Part:
    """A load and what it acts on, in the object's own frame.

    Attributes:
        load: The load.
        centre: Mean of its points, or centroid of its faces [m], shape (3,).
        area: Area of its faces [m²].
        normal: Integral of the outward normal over them [m²], shape (3,).
        moment: Integral of position × outward normal over them [m³], shape (3,).
    """

    load: ObjectLoad
    centre: NDArray[np.float64]
    area: float
    normal: NDArray[np.float64]
    moment: NDArray[np.float64]

    def at(self, body: RigidBody, frame: float) -> NDArray[np.float64]:
        """Force [N] and moment about the body's centre of mass [N m], shape (6,)."""
        if self.load.kind == "pressure":
            force = -self.load.at("pressure", frame) * self.normal
            about = -self.load.at("pressure", frame) * (self.moment - np.cross(body.shape.centre, self.normal))
            return np.concatenate([body.turn @ force, body.turn @ about])
        force = np.array([self.load.at(axis, frame) for axis in "xyz"])
        force = force if self.load.kind == "force" else self.area * force
        return np.concatenate([force, np.cross(body.turn @ (self.centre - body.shape.centre), force)])


@dataclass(frozen=True, eq=False)
class RigidLoad:
    """All external loads of one object."""

    parts: Sequence[_Part]
    spin: ObjectSpin | None

    def at(self, body: RigidBody, frame: float) -> NDArray[np.float64]:
        """Force [N] and moment about the centre of mass [N m] of the object as a rigid body, shape (6,).

        The centrifugal force of a rotation ω about an axis at distance r from the centre of mass is m ω² r, its moment
        −ω × I ω.
        """
        out = np.sum([np.zeros(6), *(part.at(body, frame) for part in self.parts)], axis=0)
        if self.spin is not None:
            way = np.array(self.spin.axis) / np.linalg.norm(self.spin.axis)
            turning = self.spin.at(frame) * way
            away = body.centre - np.array(self.spin.point)
            inertia = body.turn @ body.shape.inertia @ body.turn.T
            out[:3] += body.shape.mass * float(turning @ turning) * (away - (away @ way) * way)
            out[3:] -= np.cross(turning, inertia @ turning)
        return np.asarray(out)


def rigid_load(contact: ContactSpecification, name: str, thing: GraspObject) -> RigidLoad | None:
    """The external loads of an object; None if it has none.

    Args:
        contact: Specification with the loads.
        name: Name of the object.
        thing: Its surface and initial placement.

    Raises:
        InputError: A point set selects no point, or no complete face of the surface.
    """
    spin, loads = contact.spins.get(name), {key: load for key, load in contact.loads.items() if key[0] == name}
    parts = []
    vertices, faces = _fine_surface(thing) if loads else (thing.vertices, thing.faces)
    world = thing.place.apply(vertices)[0]
    for (_, points, _), load in loads.items():
        try:
            parts.append(_part(load, vertices, faces, load.points.choose(vertices, world)))
        except InputError as error:
            raise InputError(f"{name}: points {points}: {error.message}") from None
    return RigidLoad(tuple(parts), spin) if parts or spin is not None else None


def _fine_surface(thing: GraspObject) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
    """A surface with edges short enough to find points on, as elements would have: files may have few vertices."""
    import trimesh

    longest = float(thing.size.max()) / _ACROSS
    vertices, faces = trimesh.remesh.subdivide_to_size(thing.vertices, thing.faces, longest, max_iter=20)
    return np.asarray(vertices, np.float64), np.asarray(faces, np.int64)


def _part(
    load: ObjectLoad, vertices: NDArray[np.float64], faces: NDArray[np.integer], chosen: NDArray[np.int64]
) -> _Part:
    if load.kind == "force":
        return _Part(load, vertices[chosen].mean(axis=0), 0.0, np.zeros(3), np.zeros(3))
    corners = vertices[faces[np.isin(faces, chosen).all(axis=1)]]
    if not len(corners):
        raise InputError("no face of the surface lies between them: take more of the object")
    normal = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle, area = corners.mean(axis=1), np.linalg.norm(normal, axis=1)
    centre = area @ middle / area.sum()
    return _Part(load, centre, float(area.sum()), normal.sum(axis=0), np.cross(middle, normal).sum(axis=0))
