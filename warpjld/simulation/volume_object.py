"""Objects read from volume mesh files, with a constitutive law per region (B §3.2, §3.3, R141)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.fem import HexMesh
from warpjld.fem.mesh.exchange import read_volume_mesh
from warpjld.grasp.object_file import AXES_TO_Y, UNITS
from warpjld.grasp.objects import GraspObject, VolumeCells, make_object

__all__ = ["VOLUME_FILES", "load_volume_object", "meshed_cells", "pieces_by_region", "region_names"]

VOLUME_FILES = (".vtu", ".vtk", ".msh", ".mesh", ".inp", ".xdmf", ".med")
"""Suffixes of volume mesh files that objects are read from, by meshio."""


def load_volume_object(
    path: Path,
    *,
    name: str,
    unit: str = "m",
    up: Literal["x", "y", "z"] = "y",
    scale: float = 1.0,
    centre: bool = False,
) -> GraspObject:
    """Load an object from a volume mesh file; its surface is the boundary of the mesh.

    Args:
        path: File in a format that meshio reads.
        name: Name of the object.
        unit: Length unit of the file.
        up: Axis of the file that points up; it is rotated to Y.
        scale: Factor by which coordinates are multiplied.
        centre: Put the origin at the centre of the bounding box instead of the file's own.

    Raises:
        InputError: The file cannot be read, has no volume elements, or has inverted elements or an invalid surface.
    """
    mesh = read_volume_mesh(path, scale=UNITS[unit] * scale)
    nodes = mesh.nodes @ AXES_TO_Y[up].T
    if centre:
        nodes = nodes - 0.5 * (nodes.min(axis=0) + nodes.max(axis=0))
    try:
        return _object(name, VolumeCells(nodes, mesh.elements, mesh.regions, mesh.region_names), str(path))
    except InputError as error:
        raise InputError(error.message, path=path) from None


def region_names(thing: GraspObject) -> tuple[str, ...]:
    """Names of the regions of an object's volume mesh; empty if it has no volume mesh."""
    return () if thing.cells is None else thing.cells.region_names


def meshed_cells(name: str, cells: VolumeCells) -> HexMesh:
    """Hexahedral mesh of an object's cells.

    Regions are named ``name.region``, or ``name`` if there is only one; the boundary faces are named ``name``.
    """
    names = (name,) if len(cells.region_names) == 1 else tuple(f"{name}.{region}" for region in cells.region_names)
    mesh = HexMesh(cells.nodes, cells.elements, cells.regions, names)
    return replace(mesh, faces={name: mesh.boundary()})


def pieces_by_region(thing: GraspObject) -> list[GraspObject]:
    """Split an object into one object per region of its volume mesh, in the same frame and placement.

    Raises:
        InputError: The object has no volume mesh, or its mesh has a single region.
    """
    cells = thing.cells
    if cells is None or len(cells.region_names) < 2:
        raise InputError(f"{thing.name} has no regions: want an object from a volume file with two or more")
    out = []
    for number, region in enumerate(cells.region_names):
        elements = cells.elements[cells.regions == number]
        used, corners = np.unique(elements, return_inverse=True)
        own = np.zeros(len(elements), np.int32)
        part = VolumeCells(cells.nodes[used], corners.reshape(-1, 8).astype(np.int32), own, (region,))
        out.append(replace(_object(f"{thing.name}_{region}", part, thing.origin), place=thing.place))
    return out


def _object(name: str, cells: VolumeCells, origin: str) -> GraspObject:
    """Object with the boundary of a volume mesh as its surface."""
    mesh = HexMesh(cells.nodes, cells.elements, cells.regions, cells.region_names)
    if float(mesh.scaled_jacobian().min()) <= 0.0:
        raise InputError("the volume mesh has inverted elements, or elements without volume")
    quads = mesh.quads(mesh.boundary())
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    used, faces = np.unique(triangles, return_inverse=True)
    shape: NDArray[np.int32] = faces.reshape(-1, 3).astype(np.int32)
    return replace(make_object(name, cells.nodes[used], shape, origin=origin), cells=cells)
