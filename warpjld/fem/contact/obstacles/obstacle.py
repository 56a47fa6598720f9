"""Obstacles: surfaces in prescribed motion and their closest-point projection (R94)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32

__all__ = [
    "ClosestPoints",
    "Moving",
    "Obstacle",
    "Rigid",
    "RigidMotion",
    "checked_points",
    "checked_vector",
    "placement",
    "standing",
]

RigidMotion = Callable[[float], tuple[ArrayLike, ArrayLike]]
"""Time → position [m] and quaternion x, y, z, w: a point x of the obstacle's frame lies at rotation · x + position."""

Points = Array
"""Positions [m], shape (n, 3)."""


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """Closest-point projection of n points onto a surface.

    Attributes:
        distance: Signed distance [m], negative inside, shape (n,).
        closest: Closest points of the surface [m], shape (n, 3).
        normal: Unit normals there, outward from the obstacle, smooth across the facets of meshes, shape (n, 3).
    """

    distance: Array
    closest: Points
    normal: Points


class Obstacle(ABC):
    """A surface with prescribed motion and shape as functions of time, which contact forces do not move."""

    @abstractmethod
    def project(self, points: Points, time: float) -> ClosestPoints:
        """Closest-point projection of points (n, 3) [m] at a time."""

    @abstractmethod
    def carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """Positions at ``time_to`` of material points at ``points`` (n, 3) at ``time_from`` [m]; points off the surface
        move as if attached to it."""

    @abstractmethod
    def mesh(self, time: float) -> tuple[Points, Ints32]:
        """Vertices [m], shape (v, 3), and triangles, shape (t, 3), of the surface at a time."""


class Moving(Obstacle):
    """An obstacle with a rigid ``motion``, and a shape in its own frame that may be a function of time."""

    motion: RigidMotion | None

    @abstractmethod
    def _project(self, points: Points, time: float) -> ClosestPoints:
        """Closest-point projection in its own frame."""

    @abstractmethod
    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        """Vertices and triangles in its own frame."""

    def _carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """Material points in its own frame."""
        return points

    def project(self, points: Points, time: float) -> ClosestPoints:
        """See `Obstacle.project`."""
        points = checked_points(points)
        turn, shift = placement(self.motion, time)
        found = self._project((points - shift) @ turn, time)
        return ClosestPoints(found.distance, found.closest @ turn.T + shift, found.normal @ turn.T)

    def carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """See `Obstacle.carried`."""
        turn, shift = placement(self.motion, time_from)
        then, there = placement(self.motion, time_to)
        return np.asarray(self._carried((checked_points(points) - shift) @ turn, time_from, time_to) @ then.T + there)

    def mesh(self, time: float) -> tuple[Points, Ints32]:
        """See `Obstacle.mesh`."""
        turn, shift = placement(self.motion, time)
        vertices, faces = self._mesh(time)
        return vertices @ turn.T + shift, faces


class Rigid(Moving):
    """An obstacle with constant shape in its own frame."""


def standing(position: ArrayLike = (0.0, 0.0, 0.0), rotation: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> RigidMotion:
    """Constant motion: at rest at a position [m] with a rotation x, y, z, w."""
    placement(lambda time: (position, rotation), 0.0)
    return lambda time: (position, rotation)


def placement(motion: RigidMotion | None, time: float) -> tuple[Array, Array]:
    """Rotation matrix (3, 3) and translation (3,) [m] of a motion at a time.

    Raises:
        InputError: The motion does not return a finite position and quaternion.
    """
    if motion is None:
        return np.eye(3), np.zeros(3)
    position, rotation = (np.asarray(part, dtype=np.float64) for part in motion(time))
    if position.shape != (3,) or rotation.shape != (4,) or not np.isfinite([*position, *rotation]).all():
        raise InputError(
            f"motion at time {time:g}: want a finite position (3,) and quaternion x, y, z, w, "
            f"got {position.tolist()} and {rotation.tolist()}"
        )
    if not np.linalg.norm(rotation) > 1e-9:
        raise InputError(f"motion at time {time:g}: the quaternion has no length")
    return Rotation.from_quat(rotation).as_matrix(), position


def checked_points(points: Any) -> Points:
    """Points as float64; InputError if they are not finite or not of shape (n, 3)."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"points: want shape (n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"points: point {int(np.argwhere(~np.isfinite(array))[0][0])} is not finite")
    return array


def checked_vector(name: str, value: ArrayLike, *, above: float = -np.inf) -> Array:
    """Three finite numbers greater than ``above``; InputError otherwise."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (3,) or not np.isfinite(array).all() or not (array > above).all():
        more = "" if np.isinf(above) else f" above {above:g}"
        raise InputError(f"{name}: want three finite numbers{more}, got {array.tolist()}")
    return array
