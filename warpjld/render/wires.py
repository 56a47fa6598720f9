"""The edges of a surface inside a window: those facing the camera stronger than those behind."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.render.edges import Edges

__all__ = ["Wires"]


_DISTINCT = 14.0  # pixels between lines from which on they are drawn in full


class Wires:
    """Two sets of lines over the same vertices; every frame decides anew which edge faces the camera."""

    def __init__(self, vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> None:
        import pyvista

        self._edges = Edges(faces)
        cells = _cells(self._edges.ends)
        points = vertices.astype(np.float32)
        self._front, self._hidden = (pyvista.PolyData(points, lines=cells) for _ in range(2))

    def show(self, plotter: Any, front: str, hidden: str, *, width: float, unit: float) -> None:
        """Add the lines.

        Args:
            plotter: Where.
            front: Colour of edges that face the camera.
            hidden: Colour of the others.
            width: Of the front lines [pixels].
            unit: Pixels a metre at the surface; close lines fade, or they would hide what is inside.
        """
        ends = np.asarray(self._front.points)[self._edges.ends]
        spacing = float(np.median(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))) * unit
        strength = float(np.clip(spacing / _DISTINCT, 0.08, 1))
        for lines, color, thickness, opacity in (
            (self._hidden, hidden, 0.6 * width, strength**2),
            (self._front, front, width, strength),
        ):
            plotter.add_mesh(lines, color=color, line_width=thickness, opacity=opacity, lighting=False)

    def place(self, vertices: NDArray[np.floating], eye: tuple[float, float, float]) -> None:
        """Move the vertices, shape (n, 3)."""
        facing = self._edges.facing(vertices, eye)
        for lines, chosen in ((self._front, facing), (self._hidden, ~facing)):
            lines.points = vertices.astype(np.float32)
            lines.lines = _cells(self._edges.ends[chosen])


def _cells(ends: NDArray[np.integer]) -> NDArray[np.int64]:
    return np.insert(ends, 0, 2, axis=1).ravel().astype(np.int64)
