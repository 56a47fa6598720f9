"""Loading of objects from surface files, converted to metres with Y up."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from warpjld.errors import InputError
from warpjld.geometry.paint import paint_by_parts
from warpjld.grasp.objects import GraspObject, make_object
from warpjld.io.mesh_file import read_mesh

__all__ = ["AXES_TO_Y", "UNITS", "load_object"]

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Metres per unit of a file."""

AXES_TO_Y = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "x": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
}
"""Rotation that takes a file's up axis to Y."""


def load_object(
    path: str | Path,
    *,
    name: str | None = None,
    unit: str = "m",
    up: Literal["x", "y", "z"] = "y",
    scale: float = 1.0,
    centre: bool = False,
) -> GraspObject:
    """Read an object's surface and check it (see ``GraspObject.report``).

    Args:
        path: Surface file: OBJ, STL, PLY, OFF, glTF, …
        name: Name for messages; the file's stem if left out.
        unit: Unit of the file's coordinates, one of ``UNITS``.
        up: The file's axis that points up; it is turned to Y.
        scale: Additional factor on all coordinates.
        centre: Move the origin to the centre of the bounding box; else the file's origin is kept.

    Raises:
        InputError: Unreadable, empty, not finite, one-sided, or an unknown unit or axis.

    Examples:
        >>> from tempfile import mkdtemp
        >>> file = Path(mkdtemp()) / "wedge.off"
        >>> surface = "OFF;4 4 0;0 0 0;5 0 0;0 5 0;0 0 5;3 0 2 1;3 0 1 3;3 1 2 3;3 0 3 2"
        >>> _ = file.write_text(surface.replace(";", "\\n"))
        >>> wj.load_object(file, unit="cm")
        GraspObject('wedge': 4 facets, 0.05 × 0.05 × 0.05 m)
    """
    if unit not in UNITS:
        raise InputError(f"unit: want one of {', '.join(UNITS)}, got '{unit}'")
    if up not in AXES_TO_Y:
        raise InputError(f"up: want x, y or z, got '{up}'")
    if not (np.isfinite(scale) and scale > 0.0):
        raise InputError(f"scale: want a number above 0, got {scale:g}")
    file = read_mesh(path)
    vertices = (UNITS[unit] * scale) * file.vertices @ AXES_TO_Y[up].T
    if centre:
        vertices -= (vertices.min(axis=0) + vertices.max(axis=0)) / 2.0
    corner_uv = file.uv[file.faces] if file.corner_uv is None and file.uv is not None else file.corner_uv
    try:
        return make_object(
            name or file.path.stem,
            vertices,
            file.faces,
            parts=file.parts,
            polygons=file.polygons,
            origin=str(path),
            paint=paint_by_parts(corner_uv, file.parts, len(file.faces)),
        )
    except InputError as error:
        raise InputError(error.message, path=path) from None
