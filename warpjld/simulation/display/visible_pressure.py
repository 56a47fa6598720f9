"""Contact pressure on what is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["VisiblePressure"]


@dataclass(frozen=True, eq=False)
class VisiblePressure:
    """Contact pressure on a visible surface at a frame.

    Attributes:
        vertices: Of the surface, split where anything ever presses on it [m], shape (V, 3); the first are its own.
        triangles: Shape (T, 3).
        pressure: [Pa], shape (V,); its integral over the surface is the force that presses.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    pressure: NDArray[np.float64]
