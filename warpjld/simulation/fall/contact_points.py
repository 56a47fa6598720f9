"""Where rigid bodies touch each other and obstacles, a few points for every side that does."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.contact import Obstacle
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints
from warpjld.simulation.fall.rigid_body import RigidBody

__all__ = ["RigidContact", "contacts_with", "contacts_within"]

_ALIKE = np.cos(np.radians(10.0))
"""Points whose normals differ by less than this touch one side of something."""
_SIDES = 6
"""Sides of one thing that another touches, at most."""
_DEEP = 3.0
"""How far out a point must lie, over its gap, to be taken before a deeper one."""
_AROUND = 0.3 + np.linspace(0.0, 2.0 * np.pi, 5, endpoint=False)
"""Directions in which the outermost points of a side are looked for."""


@dataclass(frozen=True, eq=False)
class RigidContact:
    """A point at which a body may touch something.

    Attributes:
        body: Number of the body.
        other: Number of the other body; -1: an obstacle.
        point: [m], shape (3,).
        normal: Unit normal towards the body, shape (3,).
        gap: [m]; negative: overlap.
        carried: Velocity of an obstacle's surface there [m/s], shape (3,); nothing for bodies.
        friction: Coulomb's μ.
        name: Of the other.
    """

    body: int
    other: int
    point: NDArray[np.float64]
    normal: NDArray[np.float64]
    gap: float
    carried: NDArray[np.float64]
    friction: float
    name: str


@dataclass(frozen=True, eq=False)
class _Near:
    """Points near something: where (n, 3), unit normals towards the body (n, 3), and gaps (n,)."""

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
) -> list[RigidContact]:
    """Where a body is nearer than a margin [m] to obstacles.

    Args:
        number: Of the body.
        body: Itself.
        obstacles: By name.
        time: Theirs; ``step`` later they are elsewhere, after ``length`` seconds.
        step: [frames].
        length: [s].
        margin: [m].
        friction: Between two names.
        shapes: Points of the obstacles' surfaces at the time [m], by name.
    """
    out = []
    for name, obstacle in obstacles.items():
        near = _near(body, partial(_projected, obstacle, time), margin)
        sets = [near]
        if not body.shape.radius:
            sets.append(_reversed(body, shapes[name], margin))
        for points, normals, gaps in _sides(sets):
            after = obstacle.carried(points, time, time + step)
            carried = (after - points) / length
            mu = friction(body.shape.name, name)
            rows = zip(points, normals, gaps, carried, strict=True)
            out += [RigidContact(number, -1, p, n, float(g), c, mu, name) for p, n, g, c in rows]
    return out


def contacts_within(
    bodies: Sequence[RigidBody], margin: float, friction: Callable[[str, str], float]
) -> list[RigidContact]:
    """Where bodies are nearer than a margin [m] to each other."""
    out = []
    for k, one in enumerate(bodies):
        for m in range(k + 1, len(bodies)):
            other = bodies[m]
            if np.linalg.norm(one.centre - other.centre) > one.shape.reach + other.shape.reach + margin:
                continue
            sets = [_near(one, other.project, margin)]
            if not one.shape.radius:
                back = _near(other, one.project, margin)
                sets.append(_Near(back.points, -back.normals, back.gaps))
            mu, still = friction(one.shape.name, other.shape.name), np.zeros(3)
            for points, normals, gaps in _sides(sets):
                rows = zip(points, normals, gaps, strict=True)
                out += [RigidContact(k, m, p, n, float(g), still, mu, other.shape.name) for p, n, g in rows]
    return out


def _projected(obstacle: Obstacle, time: float, points: NDArray[np.float64]) -> ClosestPoints:
    return obstacle.project(points, time)


def _near(body: RigidBody, project: Callable[[NDArray[np.float64]], ClosestPoints], margin: float) -> _Near:
    """Points of a body near to something."""
    radius = body.shape.radius
    if float(project(body.centre[None]).distance[0]) > body.shape.reach + margin:
        nowhere = np.empty((0, 3))
        return _Near(nowhere, nowhere, np.empty(0))
    points = np.concatenate([body.middle[None], body.points]) if radius else body.points
    found = project(points)
    if not radius:
        near = found.distance < margin
        return _Near(points[near], found.normal[near], found.distance[near])
    # a ball touches the plane through the nearest point of every side at the point below its middle, whatever facets
    # it is drawn with
    gaps = np.einsum("ni,ni->n", found.normal, body.middle - found.closest) - radius
    gaps[0] = found.distance[0] - radius
    near = (gaps < margin) & (found.distance < margin + np.append(radius, np.zeros(len(gaps) - 1)))
    normals = found.normal[near]
    return _Near(body.middle - radius * normals, normals, gaps[near])


def _reversed(body: RigidBody, shape: NDArray[np.float64], margin: float) -> _Near:
    """Points (n, 3) of something near to a body."""
    close = shape[np.linalg.norm(shape - body.centre, axis=1) < body.shape.reach + margin]
    if not len(close):
        return _Near(close, close, np.empty(0))
    found = body.project(close)
    near = found.distance < margin
    return _Near(close[near], -found.normal[near], found.distance[near])


def _sides(
    sets: Sequence[_Near],
) -> list[tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """A few points (k, 3) of each side with their normals and gaps: the deepest, and the outermost ones around it."""
    points = np.concatenate([one.points for one in sets])
    normals = np.concatenate([one.normals for one in sets])
    gaps = np.concatenate([one.gaps for one in sets])
    out = []
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
        ways = np.stack([np.cos(_AROUND), np.sin(_AROUND)])
        outer = flat @ ways - _DEEP * (gaps[side] - gaps[deepest])[:, None]
        chosen = np.unique([deepest, *side[np.argmax(outer, axis=0)]])
        out.append((points[chosen], normals[chosen], gaps[chosen]))
    return out
