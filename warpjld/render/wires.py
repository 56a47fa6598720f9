"""Edges of a surface inside a window, those that face the camera drawn stronger than those that face away."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.render.edges import Edges

__all__ = ["Wires"]


_DISTINCT = 14.0  # distance between lines [pixels] from which on they are opaque


class Wires:
    """Two sets of lines over the same vertices, front- and back-facing edges, which are sorted anew in every frame."""

    def __init__(self, vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> None:
        import pyvista

        self._edges = Edges(faces)
        cells = _cells(self._edges.ends)
        points = vertices.astype(np.float32)
        self._front, self._hidden = (pyvista.PolyData(points, lines=cells) for _ in range(2))

    def show(self, plotter: Any, front: str, hidden: str, *, width: float, unit: float) -> None:
        """Add the lines.

        Args:
            plotter: A pyvista plotter.
            front: Colour of edges that face the camera.
            hidden: Colour of the others.
            width: Width of the front lines [pixels].
            unit: Pixels per metre at the surface: dense lines are drawn fainter, so that the inside stays visible.
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
        """Move the vertices to positions [m], shape (n, 3), and sort edges by whether they face the eye."""
        facing = self._edges.facing(vertices, eye)
        for lines, chosen in ((self._front, facing), (self._hidden, ~facing)):
            lines.points = vertices.astype(np.float32)
            lines.lines = _cells(self._edges.ends[chosen])


def _cells(ends: NDArray[np.integer]) -> NDArray[np.int64]:
    """Edges (E, 2) as VTK line cells."""
    return np.insert(ends, 0, 2, axis=1).ravel().astype(np.int64)
