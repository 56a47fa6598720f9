"""An object as a rigid body: its mass, what of it may touch, where it is and how it moves (B §3.4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints
from warpjld.grasp.objects import GraspObject, Places
from warpjld.simulation.specification import ObjectMaterial

__all__ = ["RigidBody", "RigidShape", "rigid_shape"]

_ACROSS = 10.0
"""Points across an object at which it may touch something."""
_MOST = 3000
"""Of them at most, about."""
_ON_BALL = 200
"""Points on a ball, whose own place is exact: they only look for what is around it."""


@dataclass(frozen=True, eq=False)
class RigidShape:
    """What of an object does not change as it moves, in its own frame.

    Attributes:
        name: Of the object.
        mass: [kg].
        centre: Of its mass [m], shape (3,).
        inertia: About that centre [kg m²], shape (3, 3).
        points: Of its surface, dense enough to be what touches [m], shape (n, 3).
        facets: Its surface.
        middle: Of its extents [m], shape (3,).
        reach: Its farthest point from the centre [m].
        radius: Of a ball [m]; 0 for everything else.
    """

    name: str
    mass: float
    centre: NDArray[np.float64]
    inertia: NDArray[np.float64]
    points: NDArray[np.float64]
    facets: Facets
    middle: NDArray[np.float64]
    reach: float
    radius: float = 0.0


def rigid_shape(name: str, thing: GraspObject, physical: ObjectMaterial) -> RigidShape:
    """Mass and surface of an object: solid, or a shell as thick as its wall."""
    import trimesh

    corners = thing.vertices[thing.faces]
    if physical.wall:
        middle = corners.mean(axis=1)
        area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        weight = physical.density * physical.wall * area
        mass = float(weight.sum())
        centre = weight @ middle / mass
        away = middle - centre
        inertia = np.eye(3) * float(weight @ (away**2).sum(axis=1)) - (away.T * weight) @ away
    else:
        found = trimesh.triangles.mass_properties(corners, density=physical.density)
        mass, centre = abs(float(found["mass"])), np.asarray(found["center_mass"], np.float64)
        inertia = np.asarray(found["inertia"], np.float64) * np.sign(float(found["mass"]))
    ends = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    ball = thing.origin == "ball"
    middle = 0.5 * (ends[0] + ends[1])
    return RigidShape(
        name,
        mass,
        centre,
        inertia,
        _points(thing),
        Facets(thing.vertices, thing.faces),
        middle,
        float(np.linalg.norm(thing.vertices - centre, axis=1).max()),
        0.5 * float(thing.size.max()) if ball else 0.0,
    )


def _points(thing: GraspObject) -> NDArray[np.float64]:
    """Vertices of a surface whose edges are a fraction of it at most (n, 3) [m]."""
    import trimesh

    if thing.origin == "ball":
        k = np.arange(_ON_BALL) + 0.5
        height, around = 1.0 - 2.0 * k / _ON_BALL, np.pi * (1.0 + 5.0**0.5) * k
        flat = np.sqrt(1.0 - height**2)
        middle = 0.5 * (thing.vertices.min(axis=0) + thing.vertices.max(axis=0))
        away = np.stack([flat * np.cos(around), height, flat * np.sin(around)], axis=1)
        return np.asarray(middle + 0.5 * float(thing.size.max()) * away)
    longest = float(thing.size.max()) / _ACROSS
    corners = thing.vertices[thing.faces]
    area = 0.5 * float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    )
    longest = max(longest, (2.0 * area / _MOST) ** 0.5)
    points, _ = trimesh.remesh.subdivide_to_size(thing.vertices, thing.faces, longest, max_iter=20)
    return np.unique(np.round(np.asarray(points, np.float64), 9), axis=0)


class RigidBody:
    """A rigid shape that moves.

    Args:
        shape: What it is.
        place: Where it is: one placement.

    Attributes:
        shape: What it is.
        centre: Of its mass [m], shape (3,).
        turn: Rotation matrix from its own frame, shape (3, 3).
        velocity: Of the centre [m/s], shape (3,).
        spin: Angular velocity [rad/s], shape (3,).
        touching: Names of what it touches.
    """

    def __init__(self, shape: RigidShape, place: Places) -> None:
        self.shape = shape
        self.turn: NDArray[np.float64] = Rotation.from_quat(place.rotation[0]).as_matrix()
        self.centre: NDArray[np.float64] = self.turn @ shape.centre + place.position[0]
        self.velocity = np.zeros(3)
        self.spin = np.zeros(3)
        self.touching: tuple[str, ...] = ()

    @property
    def place(self) -> Places:
        """Where it is."""
        position = self.centre - self.turn @ self.shape.centre
        return Places(position[None], Rotation.from_matrix(self.turn).as_quat()[None])

    @property
    def points(self) -> NDArray[np.float64]:
        """Where the points are that may touch (n, 3) [m]."""
        return self.stage(self.shape.points)

    @property
    def middle(self) -> NDArray[np.float64]:
        """Where the middle of its extents is [m], shape (3,)."""
        return self.stage(self.shape.middle[None])[0]

    @property
    def speed(self) -> float:
        """Of its fastest point, or more [m/s]."""
        return float(np.linalg.norm(self.velocity) + self.shape.reach * np.linalg.norm(self.spin))

    @property
    def inverse(self) -> NDArray[np.float64]:
        """Of its inertia, on the stage [1/(kg m²)], shape (3, 3)."""
        return np.asarray(self.turn @ np.linalg.inv(self.shape.inertia) @ self.turn.T)

    def stage(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) of its own frame on the stage [m]."""
        return np.asarray((points - self.shape.centre) @ self.turn.T + self.centre)

    def project(self, points: NDArray[np.float64]) -> ClosestPoints:
        """Nearest points of its surface to points (n, 3) of the stage [m]."""
        if self.shape.radius:
            away = points - self.middle
            far = np.linalg.norm(away, axis=1)
            normal = away / np.maximum(far, 1e-300)[:, None]
            return ClosestPoints(far - self.shape.radius, self.middle + self.shape.radius * normal, normal)
        found = self.shape.facets.project((points - self.centre) @ self.turn + self.shape.centre)
        return ClosestPoints(found.distance, self.stage(found.closest), found.normal @ self.turn.T)

    def moving(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities (n, 3) [m/s] of what of it is at points (n, 3)."""
        return np.asarray(self.velocity + np.cross(self.spin, points - self.centre))

    def energy(self, gravity: NDArray[np.float64]) -> float:
        """Of motion and of height [J], with the acceleration ``gravity`` (3,) [m/s²]."""
        inertia = self.turn @ self.shape.inertia @ self.turn.T
        motion = 0.5 * self.shape.mass * float(self.velocity @ self.velocity) + 0.5 * float(
            self.spin @ inertia @ self.spin
        )
        return motion - self.shape.mass * float(gravity @ self.centre)
