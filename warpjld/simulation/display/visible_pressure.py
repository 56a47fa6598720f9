"""Record of the contact pressure on a visible surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["VisiblePressure"]


@dataclass(frozen=True, eq=False)
class VisiblePressure:
    """Contact pressure on a visible surface at a frame.

    Attributes:
        vertices: Vertices of the surface, refined where it is in contact at any frame [m], shape (V, 3); the original
            ones come first.
        triangles: Triangles of the refined surface, shape (T, 3).
        pressure: Pressure at the vertices [Pa], shape (V,); its integral over the surface is the normal contact force.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    pressure: NDArray[np.float64]
