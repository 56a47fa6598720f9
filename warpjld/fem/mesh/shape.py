"""Shape functions of the 8-node hexahedron in NumPy, for loads, stresses and interpolation."""

from __future__ import annotations

import numpy as np

from warpjld.fem.arrays import Array

__all__ = ["CENTRE_GRADIENT", "CORNERS", "POINTS", "shape_at", "slope_at"]

CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float
)
"""Corners of the reference element [−1, 1]³, shape (8, 3)."""

POINTS = CORNERS / np.sqrt(3.0)
"""2 × 2 × 2 integration points, weight 1 each, shape (8, 3)."""


def shape_at(points: Array) -> Array:
    """Shape functions N_a at reference points (n, 3), shape (n, 8)."""
    h = 1.0 + CORNERS[None] * points[:, None]
    out: Array = h[..., 0] * h[..., 1] * h[..., 2] / 8.0
    return out


def slope_at(points: Array) -> Array:
    """Derivatives ∂N_a/∂ξ_j at reference points (n, 3), shape (n, 8, 3)."""
    h = 1.0 + CORNERS[None] * points[:, None]
    pairs = np.stack([h[..., 1] * h[..., 2], h[..., 0] * h[..., 2], h[..., 0] * h[..., 1]], axis=-1)
    return CORNERS[None] * pairs / 8.0


CENTRE_GRADIENT = slope_at(np.zeros((1, 3)))[0]
"""∂N_a/∂ξ_j at the centre, shape (8, 3)."""
