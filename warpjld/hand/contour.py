"""Contouring of an implicit surface by flying edges on a grid that is evaluated only near the surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["contour"]

Array = NDArray[np.float64]

_COARSE = 4  # fine cells per coarse cell, along each axis


def contour(
    field: Callable[[Array], Array], low: Array, high: Array, spacing: float
) -> tuple[Array, NDArray[np.int64]]:
    """Triangulate the zero level set of a signed distance within a box.

    The field is evaluated on every fourth grid point first, and on all of them only where the surface may pass. Far
    from it the coarse values have the right sign, which suffices for contouring.

    Args:
        field: Signed distance of points (n, 3), slope of about one.
        low, high: Corners of the box, which must hold the whole surface.
        spacing: Grid spacing.

    Returns:
        Vertices (V, 3) and triangles (T, 3), anticlockwise seen from outside.
    """
    import pyvista as pv

    cells = np.ceil((high - low) / (spacing * _COARSE)).astype(int)
    coarse_axes = [low[i] + spacing * _COARSE * np.arange(cells[i] + 1) for i in range(3)]
    coarse = field(np.stack(np.meshgrid(*coarse_axes, indexing="ij"), axis=-1).reshape(-1, 3)).reshape(cells + 1)
    near = np.abs(coarse) < 1.6 * spacing * _COARSE  # half a coarse cell's diagonal, with a margin for other slopes
    sizes = cells * _COARSE + 1
    nearest = [(np.arange(n) + _COARSE // 2) // _COARSE for n in sizes]
    block = np.ix_(*nearest)
    values, wanted = coarse[block], near[block]
    where = np.argwhere(wanted)
    values[wanted] = field(low + spacing * where)
    grid = pv.ImageData(dimensions=tuple(int(n) for n in sizes), spacing=(spacing,) * 3, origin=tuple(low))
    grid.point_data["f"] = values.ravel(order="F")
    surface = grid.contour([0.0], scalars="f", method="flying_edges", compute_normals=False)
    vertices = np.asarray(surface.points, dtype=np.float64)
    faces = np.asarray(surface.faces).reshape(-1, 4)[:, 1:].astype(np.int64)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
        faces = faces[:, ::-1]
    return vertices, faces
