"""Rigid bodies: mass properties, contact points, placement and velocity (B §3.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints
from warpjld.grasp.objects import GraspObject, Places
from warpjld.simulation.specification import ObjectMaterial

__all__ = ["RigidBody", "RigidShape", "RigidState", "rigid_shape"]

RigidState = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], tuple[str, ...]]
"""Centre, rotation matrix, velocity, spin, and names of what presses on a body."""

_ACROSS = 10.0
"""Surface points across an object's largest extent that are tested for contact."""
_MOST = 3000
"""Approximate largest number of such points."""
_ON_BALL = 200
"""Number of points on a ball; contact of a ball is exact, they only find the surfaces around it."""


@dataclass(frozen=True, eq=False)
class RigidShape:
    """Constant properties of a rigid object in its own frame.

    Attributes:
        name: Name of the object.
        mass: Mass [kg].
        centre: Centre of mass [m], shape (3,).
        inertia: Inertia tensor about the centre of mass [kg m²], shape (3, 3).
        points: Surface points tested for contact [m], shape (n, 3).
        facets: Triangulated surface.
        middle: Centre of the bounding box [m], shape (3,).
        reach: Largest distance of the surface from the centre of mass [m].
        radius: Radius of a ball [m]; 0 for other shapes.
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
    """Mass properties and surface of an object: solid, or a thin shell with the thickness of its wall."""
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
    """Points on a surface (n, 3) [m]: a Fibonacci lattice on a ball, else vertices after subdivision of long edges."""
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
    """State of a moving rigid body.

    Args:
        shape: Constant properties.
        place: Initial placement (a batch of one).

    Attributes:
        shape: Constant properties.
        centre: Centre of mass in world coordinates [m], shape (3,).
        turn: Rotation matrix from its own frame to the world, shape (3, 3).
        velocity: Velocity of the centre of mass [m/s], shape (3,).
        spin: Angular velocity [rad/s], shape (3,).
        touching: Names of the bodies and obstacles that press on it.
        bearers: Those of them that press against gravity; all of them if none does.
    """

    def __init__(self, shape: RigidShape, place: Places) -> None:
        self.shape = shape
        self.turn: NDArray[np.float64] = Rotation.from_quat(place.rotation[0]).as_matrix()
        self.centre: NDArray[np.float64] = self.turn @ shape.centre + place.position[0]
        self.velocity = np.zeros(3)
        self.spin = np.zeros(3)
        self.touching: tuple[str, ...] = ()
        self.bearers: tuple[str, ...] = ()

    @property
    def parts(self) -> Sequence[RigidBody]:
        """Its objects, each with placement and velocity: itself."""
        return (self,)

    @property
    def state(self) -> RigidState:
        """Its state, from which ``restore`` returns it to this moment."""
        return self.centre, self.turn, self.velocity, self.spin, self.touching

    def restore(self, state: RigidState) -> None:
        """Set an earlier state."""
        self.centre, self.turn, self.velocity, self.spin, self.touching = state

    @property
    def place(self) -> Places:
        """Placement of its own frame."""
        position = self.centre - self.turn @ self.shape.centre
        return Places(position[None], Rotation.from_matrix(self.turn).as_quat()[None])

    @property
    def points(self) -> NDArray[np.float64]:
        """Surface points tested for contact, in world coordinates (n, 3) [m]."""
        return self.stage(self.shape.points)

    @property
    def middle(self) -> NDArray[np.float64]:
        """Centre of its bounding box in world coordinates [m], shape (3,)."""
        return self.stage(self.shape.middle[None])[0]

    @property
    def speed(self) -> float:
        """Upper bound on the speed of its points [m/s]."""
        return float(np.linalg.norm(self.velocity) + self.shape.reach * np.linalg.norm(self.spin))

    @property
    def inverse(self) -> NDArray[np.float64]:
        """Inverse inertia tensor in world coordinates [1/(kg m²)], shape (3, 3)."""
        return np.asarray(self.turn @ np.linalg.inv(self.shape.inertia) @ self.turn.T)

    def stage(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 3) of its own frame in world coordinates [m]."""
        return np.asarray((points - self.shape.centre) @ self.turn.T + self.centre)

    def project(self, points: NDArray[np.float64]) -> ClosestPoints:
        """Closest-point projection of points (n, 3) in world coordinates [m] onto its surface."""
        if self.shape.radius:
            away = points - self.middle
            far = np.linalg.norm(away, axis=1)
            normal = away / np.maximum(far, 1e-300)[:, None]
            return ClosestPoints(far - self.shape.radius, self.middle + self.shape.radius * normal, normal)
        found = self.shape.facets.project((points - self.centre) @ self.turn + self.shape.centre)
        return ClosestPoints(found.distance, self.stage(found.closest), found.normal @ self.turn.T)

    def moving(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities (n, 3) [m/s] of the body at points (n, 3) in world coordinates."""
        return np.asarray(self.velocity + np.cross(self.spin, points - self.centre))

    def energy(self, gravity: NDArray[np.float64]) -> float:
        """Kinetic plus potential energy [J] under the acceleration ``gravity`` (3,) [m/s²]."""
        inertia = self.turn @ self.shape.inertia @ self.turn.T
        motion = 0.5 * self.shape.mass * float(self.velocity @ self.velocity) + 0.5 * float(
            self.spin @ inertia @ self.spin
        )
        return motion - self.shape.mass * float(gravity @ self.centre)
