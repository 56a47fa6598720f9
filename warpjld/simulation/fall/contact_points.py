"""Contact points of rigid bodies with each other and with obstacles: all that are near, and a few per contact plane.

Impulses are found for the few, the deepest and outermost of each plane, and for others that would overlap by them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints
from warpjld.simulation.fall.rigid_body import RigidBody

__all__ = ["ContactCandidates", "RigidContact", "contacts_with", "contacts_within"]

_ALIKE = np.cos(np.radians(10.0))
"""Cosine of the angle below which normals belong to the same contact plane."""
_SIDES = 6
"""Most contact planes between two bodies."""
_DEEP = 3.0
"""Weight of a point's gap against its lateral extent when the outermost points of a plane are selected."""
_AROUND = 0.3 + np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False)
"""Directions in a contact plane in which the outermost points are selected [rad]."""


@dataclass(frozen=True, eq=False)
class RigidContact:
    """A possible contact point of a body.

    Attributes:
        body: Index of the body.
        other: Index of the other body; -1 for an obstacle.
        point: Position [m], shape (3,).
        normal: Unit normal towards the body, shape (3,).
        gap: Signed distance [m]; negative: overlap.
        carried: Velocity of the obstacle's surface there [m/s], shape (3,); 0 for bodies.
        friction: Coulomb's μ.
        own: Name of the object that touches.
        name: Name of the other object or obstacle.
        closing: Speed at which the sides approach along the normal before the impulses of a step [m/s]; gravity
            included.
    """

    body: int
    other: int
    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    gap: float
    carried: NDArray[np.float64]
    friction: float
    own: str
    name: str
    closing: float = 0.0

    @property
    def axes(self) -> NDArray[np.float64]:
        """Normal and two tangents, orthonormal, shape (3, 3)."""
        return np.concatenate([self.normal[None], np.linalg.svd(self.normal[None])[2][1:]])


@dataclass(frozen=True, eq=False)
class ContactCandidates:
    """All possible contact points of a body with another or with an obstacle; values as in ``RigidContact``, by row.

    Attributes:
        outermost: Rows of the deepest and outermost points of each contact plane.
    """

    body: int
    other: int
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    gaps: NDArray[np.float64]
    carried: NDArray[np.float64]
    friction: float
    own: str
    name: str
    outermost: list[int]

    def contact(self, row: int) -> RigidContact:
        """The contact of a row."""
        known = self.points[row], self.normals[row], float(self.gaps[row]), self.carried[row]
        return RigidContact(self.body, self.other, *known, self.friction, self.own, self.name)

    def parting(self, bodies: Sequence[RigidBody]) -> NDArray[np.float64]:
        """Speeds at which the sides part along the normals [m/s], shape (n,)."""
        away = bodies[self.body].moving(self.points) - self.carried
        if self.other >= 0:
            away = away - bodies[self.other].moving(self.points)
        return np.asarray(np.einsum("ni,ni->n", away, self.normals))


@dataclass(frozen=True, eq=False)
class _Near:
    """Candidate points [m] (n, 3), unit normals towards the body (n, 3), and gaps [m] (n,)."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    gaps: NDArray[np.float64]


def contacts_with(
    number: int,
    body: RigidBody,
    obstacles: Mapping[str, Obstacle],
    time: float,
    step: float,
    length: float,
    margin: float,
    friction: Callable[[str, str], float],
    shapes: Mapping[str, NDArray[np.float64]],
) -> list[ContactCandidates]:
    """Contact points of a body, or a part of it, with obstacles that are closer than a margin.

    Args:
        number: Index of the body.
        body: The body, or one of its parts.
        obstacles: Obstacles by name.
        time: Time at the begin of the step [frames].
        step: Length of the step [frames].
        length: The same [s].
        margin: Largest gap considered [m].
        friction: Coulomb's μ between two names.
        shapes: Surface points of the obstacles at ``time`` [m], by name.
    """
    out = []
    for name, obstacle in obstacles.items():
        near = _near(body, partial(_projected, obstacle, time), margin)
        sets = [near]
        if not body.shape.radius:
            sets.append(_reversed(body, shapes[name], margin))
        found = _joined(sets)
        if len(found.gaps):
            after = obstacle.carried(found.points, time, time + step)
            own = body.shape.name, name
            out.append(_near_points(number, -1, found, (after - found.points) / length, friction(*own), *own))
    return out


def contacts_within(
    bodies: Sequence[RigidBody], margin: float, friction: Callable[[str, str], float]
) -> list[ContactCandidates]:
    """Contact points between bodies that are closer than a margin [m]."""
    out = []
    parts = [(k, part) for k, body in enumerate(bodies) for part in body.parts]
    for i, (k, one) in enumerate(parts):
        for m, other in parts[i + 1 :]:
            if k == m:
                continue
            if np.linalg.norm(one.centre - other.centre) > one.shape.reach + other.shape.reach + margin:
                continue
            sets = [_near(one, other.project, margin)]
            if not one.shape.radius:
                back = _near(other, one.project, margin)
                sets.append(_Near(back.points, -back.normals, back.gaps))
            found, names = _joined(sets), (one.shape.name, other.shape.name)
            if len(found.gaps):
                out.append(_near_points(k, m, found, np.zeros_like(found.points), friction(*names), *names))
    return out


def _projected(obstacle: Obstacle, time: float, points: NDArray[np.float64]) -> ClosestPoints:
    return obstacle.project(points, time)


def _near(body: RigidBody, project: Callable[[NDArray[np.float64]], ClosestPoints], margin: float) -> _Near:
    """Points of a body closer than a margin [m] to a surface, given its closest-point projection."""
    radius = body.shape.radius
    if float(project(body.centre[None]).distance[0]) > body.shape.reach + margin:
        nowhere = np.empty((0, 3))
        return _Near(nowhere, nowhere, np.empty(0))
    points = np.concatenate([body.middle[None], body.points]) if radius else body.points
    found = project(points)
    if not radius:
        near = found.distance < margin
        return _Near(points[near], found.normal[near], found.distance[near])
    # a ball is exact: for every side, the contact point is below its centre on the plane through the closest point
    gaps = np.einsum("ni,ni->n", found.normal, body.middle - found.closest) - radius
    gaps[0] = found.distance[0] - radius
    near = (gaps < margin) & (found.distance < margin + np.append(radius, np.zeros(len(gaps) - 1)))
    normals = found.normal[near]
    return _Near(body.middle - radius * normals, normals, gaps[near])


def _reversed(body: RigidBody, shape: NDArray[np.float64], margin: float) -> _Near:
    """Points of a surface (n, 3) [m] closer than a margin to a body."""
    close = shape[np.linalg.norm(shape - body.centre, axis=1) < body.shape.reach + margin]
    if not len(close):
        return _Near(close, close, np.empty(0))
    found = body.project(close)
    near = found.distance < margin
    return _Near(close[near], -found.normal[near], found.distance[near])


def _joined(sets: Sequence[_Near]) -> _Near:
    """Candidates of several sets."""
    points = np.concatenate([one.points for one in sets])
    normals = np.concatenate([one.normals for one in sets])
    return _Near(points, normals, np.concatenate([one.gaps for one in sets]))


def _near_points(
    body: int, other: int, near: _Near, carried: NDArray[np.float64], friction: float, own: str, name: str
) -> ContactCandidates:
    values = near.points, near.normals, near.gaps, carried
    return ContactCandidates(body, other, *values, friction, own, name, _outermost(near))


def _outermost(near: _Near) -> list[int]:
    """Rows of the deepest and the outermost points of each contact plane."""
    points, normals, gaps = near.points, near.normals, near.gaps
    out: list[int] = []
    left = np.ones(len(gaps), dtype=bool)
    for _ in range(_SIDES):
        if not left.any():
            break
        rows = np.flatnonzero(left)
        deepest = rows[int(np.argmin(gaps[rows]))]
        side = rows[normals[rows] @ normals[deepest] > _ALIKE]
        left[side] = False
        across = np.linalg.svd(normals[deepest][None])[2][1:]
        flat = points[side] @ across.T
        directions = np.stack([np.cos(_AROUND), np.sin(_AROUND)])
        outer = flat @ directions - _DEEP * (gaps[side] - gaps[deepest])[:, None]
        out += np.unique([deepest, *side[np.argmax(outer, axis=0)]]).tolist()
    return out
