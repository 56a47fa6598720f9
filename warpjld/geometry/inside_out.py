"""Surfaces whose triangles are wound clockwise, seen from outside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["is_inside_out"]

_INSIDE_OUT = -0.1  # largest volume of a surface that is inside out, per sum of its parts' sizes: a flat one's is 0


def is_inside_out(vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> bool:
    """Whether the volume of a surface (V, 3), (T, 3), open or closed, is clearly negative."""
    if not len(faces):
        return False
    corners = vertices[faces] - vertices[faces.ravel()].mean(axis=0)
    parts = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return bool(float(parts.sum()) < _INSIDE_OUT * float(np.abs(parts).sum()))
