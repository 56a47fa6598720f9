"""Globally deformed obstacles: taper, twist and bend of a shape (R94).

A. H. Barr, "Global and local deformations of solid primitives", SIGGRAPH '84: the three maps, their inverses, and
normals by the inverse transpose of their Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Array, Ints32
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Moving, Points, Rigid, RigidMotion

__all__ = ["Barr"]

Amount = Callable[[float], float] | float
"""A constant, or a function of time."""


class Barr(Moving):
    """A shape that is tapered, then twisted, then bent along one of its axes, and moved rigidly.

    Amounts are those between the two ends of the shape along the axis. A bend is towards the next axis in the cyclic
    order x, y, z: a rod along y bends towards z, with its middle fixed.

    Args:
        shape: A rigid obstacle, or vertices [m] (v, 3) and triangles (t, 3). Flat sides need enough vertices to bend.
        axis: ``x``, ``y`` or ``z`` of the shape's frame.
        taper: Fraction by which the far end is narrower than the near end, below 1; negative makes it wider.
        twist: Angle between the ends [rad].
        bend: Angle between the ends [rad].
        motion: Rigid motion of the deformed shape, see ``RigidMotion``.

    Raises:
        InputError: An unknown axis, or a shape without extent along it.
    """

    def __init__(
        self,
        shape: Rigid | tuple[ArrayLike, ArrayLike],
        *,
        axis: Literal["x", "y", "z"] = "y",
        taper: Amount = 0.0,
        twist: Amount = 0.0,
        bend: Amount = 0.0,
        motion: RigidMotion | None = None,
    ) -> None:
        if axis not in ("x", "y", "z"):
            raise InputError(f"Barr axis: want x, y or z, got '{axis}'")
        vertices, faces = shape.mesh(0.0) if isinstance(shape, Rigid) else shape
        self._rest = Facets(vertices, faces)
        if isinstance(shape, Rigid):
            # exact normals of the shape at each corner, evaluated slightly inside the facet to be unique at edges
            x = self._rest.vertices[self._rest.faces]
            corners = 0.999 * x + 0.001 * x.mean(axis=1, keepdims=True)
            exact = shape.project(corners.reshape(-1, 3), 0.0).normal.reshape(corners.shape)
            self._rest.move(self._rest.vertices, exact)
        self._shape = Facets(vertices, faces)
        along = "xyz".index(axis)
        # columns u, w, v: the axis is the second; a bend is towards the third
        self._order = [(along + 2) % 3, along, (along + 1) % 3]
        reach = self._rest.vertices[:, along]
        self._low, self._high = float(reach.min()), float(reach.max())
        if not self._high > self._low:
            raise InputError(f"Barr: the shape has no extent along {axis}")
        across = self._rest.vertices[:, [k for k in range(3) if k != along]]
        self._middle = 0.5 * (across.min(axis=0) + across.max(axis=0))
        self._centre = np.zeros(3)
        self._centre[[k for k in range(3) if k != along]] = self._middle
        self._amounts = (taper, twist, bend)
        self.motion = motion
        self._now: tuple[float, ...] | None = (0.0, 0.0, 0.0)

    def _project(self, points: Points, time: float) -> ClosestPoints:
        """Projection onto the facets of the deformed shape, with Barr's normals."""
        return self._at(time).project(points)

    def _carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """Inverse map of one time followed by the map of the other."""
        return self._deformed(self._undeformed(points, self._values(time_from)), self._values(time_to))

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        return self._deformed(self._rest.vertices, self._values(time)), self._rest.faces

    def _at(self, time: float) -> Facets:
        values = self._values(time)
        if values != self._now:
            self._shape.move(self._deformed(self._rest.vertices, values), self._normals(values))
            self._now = values
        return self._shape

    def _values(self, time: float) -> tuple[float, float, float]:
        taper, twist, bend = (float(a(time)) if callable(a) else float(a) for a in self._amounts)
        if not np.isfinite([taper, twist, bend]).all() or taper >= 1.0:
            raise InputError(
                f"Barr at time {time:g}: want finite amounts and a taper below 1, got taper {taper:g}, "
                f"twist {twist:g}, bend {bend:g}"
            )
        return taper, twist, bend

    def _normals(self, values: tuple[float, float, float]) -> Array:
        """Normals of the corners, shape (t, 3, 3): det J · J⁻ᵀ of those at rest, J by central differences."""
        step = 1e-5 * self._rest.size
        inner = self._rest.vertices.copy()
        along = inner[:, self._order[1]]
        along.clip(self._low + step, self._high - step, out=along)  # the maps are not smooth at the ends
        columns = [self._deformed(inner + h, values) - self._deformed(inner - h, values) for h in step * np.eye(3)]
        a, b, c = columns
        cofactor = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2) / step**2
        return np.asarray(np.einsum("tkij,tkj->tki", cofactor[self._rest.faces], self._rest.corner_normals))

    def _deformed(self, points: Points, values: tuple[float, float, float]) -> Points:
        taper, twist, bend = values
        u, w, v = ((points - self._centre)[:, k] for k in self._order)
        share = np.clip((w - self._low) / (self._high - self._low), 0.0, 1.0)
        narrow = 1.0 - taper * share
        u, v = narrow * u, narrow * v
        angle = twist * (share - 0.5)
        cos, sin = np.cos(angle), np.sin(angle)
        u, v = u * cos + v * sin, v * cos - u * sin
        w, v = _bent(w, v, bend, self._low, self._high)
        return self._back(u, w, v)

    def _undeformed(self, points: Points, values: tuple[float, float, float]) -> Points:
        taper, twist, bend = values
        u, w, v = ((points - self._centre)[:, k] for k in self._order)
        w, v = _straight(w, v, bend, self._low, self._high)
        share = np.clip((w - self._low) / (self._high - self._low), 0.0, 1.0)
        angle = twist * (share - 0.5)
        cos, sin = np.cos(angle), np.sin(angle)
        u, v = u * cos - v * sin, v * cos + u * sin
        narrow = 1.0 - taper * share
        return self._back(u / narrow, w, v / narrow)

    def _back(self, u: Array, w: Array, v: Array) -> Points:
        out = np.empty((len(u), 3))
        for column, part in zip(self._order, (u, w, v), strict=True):
            out[:, column] = part
        return out + self._centre


def _bent(w: Array, v: Array, bend: float, low: float, high: float) -> tuple[Array, Array]:
    """Barr's bend about the middle of the range: lengths along the axis become angles; rigid beyond the ends."""
    middle, rate = 0.5 * (low + high), bend / (high - low)
    held = np.clip(w, low, high)
    angle = rate * (held - middle)
    cos, sin = np.cos(angle), np.sin(angle)
    along, up = _arc(held - middle, angle)
    beyond = w - held
    return middle + along - v * sin + beyond * cos, up + v * cos + beyond * sin


def _straight(w: Array, v: Array, bend: float, low: float, high: float) -> tuple[Array, Array]:
    """Inverse of ``_bent``, for points closer than the centre of curvature."""
    middle, rate = 0.5 * (low + high), bend / (high - low)
    away = w - middle
    angle = np.arctan2(rate * away, 1.0 - rate * v)
    held = np.clip(middle + (angle / rate if abs(rate) > 1e-9 / (high - low) else away), low, high)
    angle = rate * (held - middle)
    cos, sin = np.cos(angle), np.sin(angle)
    along, up = _arc(held - middle, angle)
    off, rise = away - along, v - up
    return held + off * cos + rise * sin, rise * cos - off * sin


def _arc(length: Array, angle: Array) -> tuple[Array, Array]:
    """End point of a circular arc of given length and angle: along its initial direction, and across it."""
    half = np.sinc(angle / (2.0 * np.pi))
    return length * np.sinc(angle / np.pi), 0.5 * length * angle * half**2
