"""Analytic obstacles with exact distances and normals: plane, sphere, box and cylinder."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Points, Rigid, RigidMotion, checked_vector
from warpjld.geometry.box_surface import box_surface

__all__ = ["Box", "Cylinder", "Plane", "Sphere"]


@dataclass(frozen=True, eq=False)
class Plane(Rigid):
    """The half-space behind a plane.

    Attributes:
        point: A point on the plane [m].
        normal: Normal out of the obstacle, of any length but zero.
        motion: See ``RigidMotion``.
        extent: Side of the square by which it is drawn [m].

    Raises:
        InputError: A normal of length zero.
    """

    point: ArrayLike = (0.0, 0.0, 0.0)
    normal: ArrayLike = (0.0, 1.0, 0.0)
    motion: RigidMotion | None = None
    extent: float = 0.3
    _middle: Points = field(init=False, repr=False)
    _out: Points = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_middle", checked_vector("plane point", self.point))
        object.__setattr__(self, "_out", _direction("plane normal", self.normal))

    def _project(self, points: Points, time: float) -> ClosestPoints:
        distance = (points - self._middle) @ self._out
        return ClosestPoints(distance, points - distance[:, None] * self._out, np.tile(self._out, (len(points), 1)))

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        along, across = _square(self._out)
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        vertices = [self._middle + 0.5 * self.extent * (a * along + b * across) for a, b in corners]
        return np.array(vertices), np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


@dataclass(frozen=True, eq=False)
class Sphere(Rigid):
    """A ball.

    Attributes:
        centre: Centre [m].
        radius: Radius [m].
        motion: See ``RigidMotion``.

    Raises:
        InputError: A radius that is not above 0.
    """

    centre: ArrayLike
    radius: float
    motion: RigidMotion | None = None
    _middle: Points = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_middle", checked_vector("sphere centre", self.centre))
        _length("sphere radius", self.radius)

    def _project(self, points: Points, time: float) -> ClosestPoints:
        away = points - self._middle
        reach = np.linalg.norm(away, axis=1)
        normal = np.divide(away, reach[:, None], out=np.tile([0.0, 1.0, 0.0], (len(away), 1)), where=reach[:, None] > 0)
        return ClosestPoints(reach - self.radius, self._middle + self.radius * normal, normal)

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        import trimesh

        ball = trimesh.creation.icosphere(subdivisions=4, radius=self.radius)
        return np.asarray(ball.vertices) + self._middle, np.asarray(ball.faces, dtype=np.int32)


@dataclass(frozen=True, eq=False)
class Box(Rigid):
    """A box along the axes of its frame.

    Attributes:
        size: Extents along x, y and z [m].
        centre: Centre [m].
        edge: Radius to which its edges and corners are rounded [m].
        motion: See ``RigidMotion``.

    Raises:
        InputError: A size that is not above 0, or a radius above half the smallest extent.
    """

    size: ArrayLike
    centre: ArrayLike = (0.0, 0.0, 0.0)
    edge: float = 0.0
    motion: RigidMotion | None = None
    _middle: Points = field(init=False, repr=False)
    _half: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_middle", checked_vector("box centre", self.centre))
        object.__setattr__(self, "_half", 0.5 * checked_vector("box size", self.size, above=0.0))
        _rounding("box", self.edge, float(self._half.min()))

    def _project(self, points: Points, time: float) -> ClosestPoints:
        found = _round_box(points - self._middle, self._half, self.edge)
        return ClosestPoints(found.distance, found.closest + self._middle, found.normal)

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        rim = self.edge * (1.0 - np.tan(np.linspace(0.0, 0.25 * np.pi, 6 if self.edge else 1)))
        points, faces = box_surface([np.unique(np.concatenate([rim - h, h - rim, [-h, h]])) for h in self._half])
        vertices, weld = np.unique(points, axis=0, return_inverse=True)
        rounded = _round_box(vertices, self._half, self.edge).closest + self._middle
        return rounded, np.asarray(weld.ravel()[faces], dtype=np.int32)


@dataclass(frozen=True, eq=False)
class Cylinder(Rigid):
    """A cylinder with flat ends.

    Attributes:
        radius: Radius [m].
        length: Length from end to end [m].
        centre: Centre [m].
        axis: Direction of the axis, of any length but zero.
        edge: Radius to which its two rims are rounded [m].
        motion: See ``RigidMotion``.

    Raises:
        InputError: Radius or length not above 0, an axis of length zero, or a rim radius that is too large.
    """

    radius: float
    length: float
    centre: ArrayLike = (0.0, 0.0, 0.0)
    axis: ArrayLike = (0.0, 1.0, 0.0)
    edge: float = 0.0
    motion: RigidMotion | None = None
    _middle: Points = field(init=False, repr=False)
    _along: Points = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_middle", checked_vector("cylinder centre", self.centre))
        object.__setattr__(self, "_along", _direction("cylinder axis", self.axis))
        _length("cylinder radius", self.radius)
        _length("cylinder length", self.length)
        _rounding("cylinder", self.edge, min(self.radius, 0.5 * self.length))

    def _project(self, points: Points, time: float) -> ClosestPoints:
        # a rectangle in the half-plane of the axis and the point
        axis = self._along
        away = points - self._middle
        along = away @ axis
        across = away - along[:, None] * axis
        reach = np.linalg.norm(across, axis=1)
        any_way = np.tile(_square(axis)[0], (len(points), 1))
        outwards = np.divide(across, reach[:, None], out=any_way, where=reach[:, None] > 0)
        flat = _round_box(np.stack([reach, along], axis=1), np.array([self.radius, 0.5 * self.length]), self.edge)
        closest, normal = (f[:, :1] * outwards + f[:, 1:] * axis for f in (flat.closest, flat.normal))
        return ClosestPoints(flat.distance, closest + self._middle, normal)

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        around = 96
        rim = np.linspace(0.0, 0.5 * np.pi, 7 if self.edge else 1)
        r = self.radius - self.edge * (1.0 - np.sin(rim))
        h = 0.5 * self.length - self.edge * (1.0 - np.cos(rim))
        # an additional ring on the flat ends, against slender triangles
        r, h = np.concatenate([[0.5 * r[0]], r]), np.concatenate([[h[0]], h])
        steps = max(1, int(np.ceil((2.0 * h[-1]) / (2.0 * np.pi * self.radius / around))))
        side = np.linspace(h[-1], -h[-1], min(steps, 200) + 1)[1:-1]
        rings_r = np.concatenate([r, np.full(len(side), self.radius), r[::-1]])
        rings_h = np.concatenate([h, side, -h[::-1]])
        u, v = _square(self._along)
        angle = 2.0 * np.pi * np.arange(around) / around
        circle = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
        rings = rings_r[:, None, None] * circle + rings_h[:, None, None] * self._along
        poles = 0.5 * self.length * np.array([self._along, -self._along])
        number = np.arange(len(rings) * around).reshape(len(rings), around)
        after = np.roll(number, -1, axis=1)
        a, b, c, d = (part.ravel() for part in (number[:-1], number[1:], after[1:], after[:-1]))
        top = np.full(around, number.size)
        faces = [np.stack(t, axis=1) for t in ((a, b, c), (a, c, d), (top, number[0], after[0]))]
        faces.append(np.stack([top + 1, after[-1], number[-1]], axis=1))
        vertices = np.concatenate([rings.reshape(-1, 3), poles]) + self._middle
        return vertices, np.concatenate(faces).astype(np.int32)


def _round_box(points: Array, half: Array, edge: float) -> ClosestPoints:
    """Projection onto a box |x| ≤ half with rounded edges, in two or three dimensions: a smaller box plus a radius."""
    core = half - edge
    inner = np.clip(points, -core, core)
    away = points - inner
    reach = np.linalg.norm(away, axis=1)
    deep = reach == 0.0
    normal = np.divide(away, reach[:, None], out=np.zeros_like(away), where=~deep[:, None])
    distance = reach - edge
    closest = inner + edge * normal
    beyond = np.abs(points[deep]) - core
    axis = beyond.argmax(axis=1)
    rows = np.arange(len(axis))
    flat = np.zeros_like(beyond)
    flat[rows, axis] = np.where(points[deep][rows, axis] < 0.0, -1.0, 1.0)
    onto = points[deep].copy()
    onto[rows, axis] = (flat * half)[rows, axis]
    normal[deep], closest[deep] = flat, onto
    distance[deep] = beyond[rows, axis] - edge
    return ClosestPoints(distance, closest, normal)


def _square(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors that complete a unit axis to a right-handed frame: u × v = axis."""
    u = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def _direction(name: str, value: ArrayLike) -> Array:
    vector = checked_vector(name, value)
    length = float(np.linalg.norm(vector))
    if not length > 1e-12:
        raise InputError(f"{name}: has no direction")
    return vector / length


def _length(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise InputError(f"{name}: want metres above 0, got {value}")


def _rounding(name: str, edge: float, most: float) -> None:
    if not 0.0 <= edge <= most:
        raise InputError(f"{name} edge: want a radius of 0 to {most:g} m, got {edge}")
