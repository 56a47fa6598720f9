"""Implicit surface of a digit by sweeping a cross-section along a curved centre line.

Cross-sections are perpendicular to one straight axis and shifted to the centre line. So a point's section is found by a
dot product, smooth everywhere, and a bent digit has none of the creases that projection on a polyline makes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

__all__ = ["FAR", "Sweep", "section_distance"]

Array = NDArray[np.float64]

_ROWS = 512  # rows of the tables along the axis: errors of the interpolation stay below a micrometre
FAR = 40.0  # largest distance that is computed [mm], beyond every blending radius
_CENTROID = 4.0 / (3.0 * np.pi)  # height of a half ellipse's centroid, in half-heights


@dataclass(frozen=True, eq=False)
class Sweep:
    """Signed distance [mm] of a swept solid, exact to first order at the surface.

    Attributes:
        origin: Origin of the axis [mm], shape (3,).
        frame: Lateral, dorsal and axial direction as rows, shape (3, 3).
        ends: Axial coordinates of the closed ends [mm].
        caps: Axial coordinates where the rounding of either end begins [mm].
        squareness: 0 for elliptic sections, towards 1 for rectangular ones.
        table: Centre (lateral, dorsal), half-width, dorsal and palmar half-height along the axis [mm], shape (n, 5).
        nail: Axial coordinate of the nail's middle, its half-length and half-width [mm], if there is one.
    """

    origin: Array
    frame: Array
    ends: tuple[float, float]
    caps: tuple[float, float]
    squareness: float
    table: Array
    nail: tuple[float, float, float] | None = None

    @classmethod
    def through(
        cls,
        origin: Array,
        frame: Array,
        ends: tuple[float, float],
        caps: tuple[float, float],
        squareness: float,
        centres: Sequence[tuple[float, float, float]],
        profile: Sequence[tuple[float, float, float, float]],
        nail: tuple[float, float, float] | None = None,
    ) -> Sweep:
        """Swept solid whose sections have their centroids on a natural cubic spline.

        Args:
            origin: As of the class; likewise ``frame``, ``ends``, ``caps``, ``squareness`` and ``nail``.
            centres: Centroids that the spline passes through: axial, lateral, dorsal coordinate [mm].
            profile: Sizes: axial coordinate, half-width, dorsal half-height, palmar half-height [mm].
        """
        along = np.linspace(*ends, _ROWS)
        centre, sizes = np.array(centres), np.array(profile)
        line = CubicSpline(centre[:, 0], centre[:, 1:], bc_type="natural")(along)
        inside = np.clip(along, sizes[0, 0], sizes[-1, 0])
        half = CubicSpline(sizes[:, 0], sizes[:, 1:], bc_type="natural")(inside)
        line[:, 1] -= _CENTROID * (half[:, 1] - half[:, 2])  # halves of unequal height: keep the section's centroid
        return cls(origin, frame, ends, caps, squareness, np.column_stack([line, half]), nail)

    def __call__(self, points: Array, detail: float = 0.0) -> Array:
        """Signed distance of points [mm], negative inside, shape (n,); ``FAR`` for those farther than that.

        Args:
            points: Positions [mm], shape (n, 3).
            detail: Relative depth of the nail's relief, 0…1.
        """
        local = (points - self.origin) @ self.frame.T
        low, high = self._box
        inside = (local > low) & (local < high)
        near = np.flatnonzero(inside[:, 0] & inside[:, 1] & inside[:, 2])
        out = np.full(len(points), FAR)
        if len(near):
            out[near] = self._distance(local[near], detail)
        return out

    @cached_property
    def _box(self) -> tuple[Array, Array]:
        """Lower and upper corner of the solid's box in its own frame, enlarged by ``FAR`` [mm]."""
        cu, cv, width, dorsal, palmar = self.table.T
        low = np.array([(cu - width).min(), (cv - palmar).min(), self.ends[0]])
        high = np.array([(cu + width).max(), (cv + dorsal).max(), self.ends[1]])
        return low - FAR, high + FAR

    def _distance(self, local: Array, detail: float) -> Array:
        """Signed distance of points in the solid's own frame."""
        s = local[:, 2]
        low, high = self.ends
        place = np.clip((s - low) * ((_ROWS - 1) / (high - low)), 0.0, _ROWS - 1.001)
        row = place.astype(np.int64)
        part = (place - row)[:, None]
        cu, cv, width, dorsal, palmar = ((1.0 - part) * self.table[row] + part * self.table[row + 1]).T
        u, v = local[:, 0] - cu, local[:, 1] - cv
        start, end = self.caps
        beyond = np.maximum(s - end, 0.0) / (high - end) + np.maximum(start - s, 0.0) / (start - low)
        length = np.where(s > end, high - end, start - low)
        out = section_distance(u, v, beyond, width, np.where(v > 0.0, dorsal, palmar), length, self.squareness)
        if self.nail and detail > 0.0:
            out += detail * self._fold(u, v / dorsal, s)
        return out

    def _fold(self, u: Array, height: Array, s: Array) -> Array:
        """Relief of the nail [mm], positive inwards: the fold of skin around it, less the raised nail plate."""
        assert self.nail is not None
        middle, half_length, half_width = self.nail
        along = (s - middle) / half_length
        rim = np.sqrt(np.sqrt((u / half_width) ** 4 + along**4))
        away = (rim - 1.0) * half_width
        upper = np.clip(2.5 * height, 0.0, 1.0)
        free = 0.5 + 0.5 * np.tanh(4.0 * (along - 0.55))  # less fold at the nail's free edge
        fold = 0.045 * half_width * np.exp(-((away / (0.10 * half_width)) ** 2)) * (1.0 - 0.7 * free)
        plate = 0.02 * half_width / (1.0 + np.exp(np.clip(away / (0.05 * half_width), -30.0, 30.0)))
        return upper * upper * (3.0 - 2.0 * upper) * (fold - plate)


def section_distance(
    u: Array, v: Array, beyond: Array, width: Array, height: Array, length: Array | float, squareness: Array | float
) -> Array:
    """Approximate distance to the surface of section |(u / width, v / height)| = 1, closed where ``beyond`` is 1.

    Sections are squircles a² + b² − κ a² b² = 1, which need no powers; ``beyond`` enters with exponent 2.5 so that
    curvature is continuous where a cap begins.
    """
    a, b = (u / width) ** 2, (v / height) ** 2
    c = beyond * beyond * np.sqrt(beyond)
    q = a + b + c
    level = np.sqrt(0.5 * (q + np.sqrt(np.maximum(q * q - 4.0 * squareness * a * b, 0.0))))
    slope = np.sqrt(a / width**2 + b / height**2 + c / length**2)
    return (level - 1.0) * np.sqrt(q + 1e-12) / (slope + 1e-9)
