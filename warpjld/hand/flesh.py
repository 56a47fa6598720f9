"""Implicit surface of the whole hand: smooth union of palm and digits, with separate fingers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.hand.palm import PalmSlab
from warpjld.hand.plan import Plan

__all__ = ["PlannedFlesh"]

Array = NDArray[np.float64]

_BLOCK = 16_384  # points evaluated at once
_BETWEEN_FINGERS = 1.6  # blending radius between fingers [mm of the design hand]
_FINGER_ROOT = 9.0  # blending radius at the roots of fingers [mm of the design hand]
_THUMB_ROOT = 16.0  # blending radius at the thumb and muscles [mm of the design hand]


@dataclass(frozen=True, eq=False)
class PlannedFlesh:
    """Signed distance [mm] of a planned hand, exact to first order at the surface.

    Attributes:
        plan: Layout of the hand.
        detail: Amount of details that need fine triangles (nails), 0…1.
    """

    plan: Plan
    detail: float = 0.0

    def __call__(self, points: Array) -> Array:
        """Signed distance of points (n, 3) [mm], negative inside, shape (n,)."""
        if len(points) > _BLOCK:  # blocks whose intermediate arrays stay in the cache
            parts = [self(points[i : i + _BLOCK]) for i in range(0, len(points), _BLOCK)]
            return np.concatenate(parts)
        scale = float(self.plan.stretch[0])
        fingers = None
        for name in ("pinky", "ring", "middle", "index"):
            finger = self.plan.digits[name].flesh(points, self.detail)
            fingers = finger if fingers is None else _join(fingers, finger, _BETWEEN_FINGERS * scale)
        assert fingers is not None
        hand = _join(PalmSlab(self.plan.stretch)(points), fingers, _FINGER_ROOT * scale)
        thumb = self.plan.digits["thumb"].flesh(points, self.detail)
        for part in (thumb, *(muscle(points) for muscle in self.plan.muscles)):
            hand = _join(hand, part, _THUMB_ROOT * scale)
        return hand

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper corner of a box that contains the surface [mm]."""
        corners = [*PalmSlab(self.plan.stretch).corners]
        for digit in self.plan.digits.values():
            flesh = digit.flesh
            reach = float(flesh.table[:, 2:].max())
            for end in flesh.ends:
                tip = flesh.origin + flesh.frame[2] * end
                corners += [tip - reach, tip + reach]
        margin = _THUMB_ROOT * float(self.plan.stretch[0])
        return np.min(corners, axis=0) - margin, np.max(corners, axis=0) + margin

    def slope(self, points: Array) -> tuple[Array, Array]:
        """Distance (n,) [mm] and its gradient (n, 3), by finite differences over the corners of a tetrahedron."""
        step = 0.02
        corners = np.array([(1, -1, -1), (-1, -1, 1), (-1, 1, -1), (1, 1, 1)], dtype=np.float64)
        values = np.stack([self(points + step * corner) for corner in corners])
        return values.mean(axis=0), np.einsum("kn,kc->nc", values, corners) / (4.0 * step)

    def project(self, points: Array, steps: int = 3) -> Array:
        """Project points near the surface onto it by Newton steps along the gradient, shape (n, 3)."""
        for _ in range(steps):
            value, gradient = self.slope(points)
            length = np.maximum((gradient**2).sum(axis=1), 0.05)
            points = points - np.clip(value / length, -2.0, 2.0)[:, None] * gradient
        return points


def _join(a: Array, b: Array, radius: float) -> Array:
    """Smooth minimum with continuous curvature: differs from the minimum only where |a − b| < radius."""
    overlap = np.maximum(1.0 - np.abs(a - b) / radius, 0.0)
    return np.minimum(a, b) - overlap**3 * (radius / 6.0)
