"""Bonded objects that move as one rigid body (R101, R102)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints
from warpjld.grasp import Places
from warpjld.simulation.fall.rigid_body import RigidBody, RigidShape

__all__ = ["RigidCluster", "rigid_union"]


class RigidCluster(RigidBody):
    """Several objects as one rigid body; its own frame is the world at its creation.

    Args:
        members: Shape and placement of each object.
    """

    def __init__(self, members: Sequence[tuple[RigidShape, Places]]) -> None:
        self._members = tuple(members)
        super().__init__(_shape_of([RigidBody(shape, place) for shape, place in members]), Places.of((0.0, 0.0, 0.0)))

    @property
    def parts(self) -> Sequence[RigidBody]:
        """Its objects, each with placement and velocity."""
        turn, now = Rotation.from_matrix(self.turn), self.place
        out = []
        for shape, place in self._members:
            turned = (turn * Rotation.from_quat(place.rotation[0])).as_quat()
            part = RigidBody(shape, Places.of(now.apply(place.position)[0, 0], turned))
            part.velocity, part.spin = self.moving(part.centre[None])[0], self.spin
            out.append(part)
        return out

    def project(self, points: NDArray[np.float64]) -> ClosestPoints:
        """Closest-point projection of points (n, 3) in world coordinates [m] onto the union of its objects."""
        found = [part.project(points) for part in self.parts]
        nearest = np.argmin([one.distance for one in found], axis=0)
        rows = np.arange(len(points))
        parts = (np.stack([getattr(one, name) for one in found]) for name in ("distance", "closest", "normal"))
        return ClosestPoints(*(part[nearest, rows] for part in parts))


def rigid_union(members: Sequence[tuple[RigidShape, Places]]) -> RigidBody:
    """One object or several as a rigid body."""
    return RigidBody(*members[0]) if len(members) == 1 else RigidCluster(members)


def _shape_of(bodies: Sequence[RigidBody]) -> RigidShape:
    """Mass properties and surface of several bodies together, in world coordinates."""
    masses = np.array([one.shape.mass for one in bodies])
    centres = np.stack([one.centre for one in bodies])
    centre = masses @ centres / masses.sum()
    inertia = np.zeros((3, 3))
    for one, mass, away in zip(bodies, masses, centres - centre, strict=True):
        inertia += one.turn @ one.shape.inertia @ one.turn.T + mass * (away @ away * np.eye(3) - np.outer(away, away))
    corners = [one.stage(one.shape.facets.vertices) for one in bodies]
    first = np.cumsum([0, *(len(part) for part in corners)])
    faces = [one.shape.facets.faces + start for one, start in zip(bodies, first[:-1], strict=True)]
    vertices = np.concatenate(corners)
    return RigidShape(
        " and ".join(one.shape.name for one in bodies),
        float(masses.sum()),
        centre,
        inertia,
        np.concatenate([one.points for one in bodies]),
        Facets(vertices, np.concatenate(faces)),
        0.5 * (vertices.min(axis=0) + vertices.max(axis=0)),
        float(np.linalg.norm(vertices - centre, axis=1).max()),
    )
