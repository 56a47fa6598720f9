"""Triangulated obstacles: rigid, or deformed by key frames (R94)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from warpjld.errors import InputError
from warpjld.fem.arrays import Ints32
from warpjld.fem.contact.obstacles.facets import Facets
from warpjld.fem.contact.obstacles.obstacle import ClosestPoints, Moving, Points, Rigid, RigidMotion

__all__ = ["Keyframed", "RigidMesh"]


class RigidMesh(Rigid):
    """A rigid triangulated surface.

    Args:
        vertices: [m], shape (v, 3).
        faces: Triangles, shape (t, 3).
        motion: See ``RigidMotion``.

    Raises:
        InputError: See ``Facets``.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, motion: RigidMotion | None = None) -> None:
        self._facets = Facets(vertices, faces)
        self.motion = motion

    def _project(self, points: Points, time: float) -> ClosestPoints:
        return self._facets.project(points)

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        return self._facets.vertices, self._facets.faces


class Keyframed(Moving):
    """A surface with vertices given at times, linearly interpolated between them and constant outside.

    Args:
        faces: Triangles, shape (t, 3).
        times: Increasing, shape (T,).
        vertices: [m], shape (T, v, 3).
        motion: Rigid motion of the deformed shape, see ``RigidMotion``.

    Raises:
        InputError: Times that do not increase, wrong shapes, or see ``Facets``.
    """

    def __init__(
        self, faces: ArrayLike, times: ArrayLike, vertices: ArrayLike, motion: RigidMotion | None = None
    ) -> None:
        self.motion = motion
        self._times = np.asarray(times, dtype=np.float64)
        self._vertices = np.asarray(vertices, dtype=np.float64)
        if self._times.ndim != 1 or len(self._times) == 0 or not (np.diff(self._times) > 0.0).all():
            raise InputError("keyframed obstacle: want increasing times, at least one")
        shape = self._vertices.shape
        if len(shape) != 3 or shape[0] != len(self._times) or shape[2] != 3 or not np.isfinite(self._vertices).all():
            raise InputError(
                f"keyframed obstacle: want finite vertices of shape ({len(self._times)}, n, 3), got {shape}"
            )
        self._facets = Facets(self._vertices[0], faces)
        self._now = float(self._times[0])

    def _project(self, points: Points, time: float) -> ClosestPoints:
        return self._at(time).project(points)

    def _carried(self, points: Points, time_from: float, time_to: float) -> Points:
        """Material points, carried along with their nearest facets."""
        return self._at(time_from).carried(points, self._shape(time_to))

    def _mesh(self, time: float) -> tuple[Points, Ints32]:
        return self._shape(time), self._facets.faces

    def _at(self, time: float) -> Facets:
        moment = float(np.clip(time, self._times[0], self._times[-1]))
        if moment != self._now:
            self._facets.move(self._shape(moment))
            self._now = moment
        return self._facets

    def _shape(self, time: float) -> Points:
        after = int(np.searchsorted(self._times, time))
        if after == 0:
            return np.asarray(self._vertices[0])
        if after == len(self._times):
            return np.asarray(self._vertices[-1])
        part = (time - self._times[after - 1]) / (self._times[after] - self._times[after - 1])
        return np.asarray((1.0 - part) * self._vertices[after - 1] + part * self._vertices[after])
