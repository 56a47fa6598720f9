"""Reader of volume meshes of other programs, by meshio."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np

from warpjld.errors import InputError, MissingExtraError
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.io.meshio_process import with_meshio
from warpjld.io.meshio_volume import VOLUME_FILE

__all__ = ["read_volume_mesh"]


def read_volume_mesh(path: Path, *, scale: float = 1.0) -> HexMesh:
    """Read hexahedra, prisms and tetrahedra (the last two as degenerate hexahedra, R96); other cells are ignored.

    Regions are taken from ``region``, ``gmsh:physical`` or ``medit:ref`` cell data, if present.

    Args:
        path: File in any format that meshio reads.
        scale: Metres per unit of the file.

    Raises:
        InputError: Unreadable, or without volume elements.
        MissingExtraError: meshio is not installed.
    """
    if find_spec("meshio") is None:
        raise MissingExtraError("reading volume meshes", "mesh")
    if not path.is_file():
        raise InputError("no such file", path=path)
    here = ("warpjld.io.meshio_volume", "leave_volume_mesh")
    with with_meshio(here, path, "a volume mesh", scale) as answer, np.load(answer.folder / VOLUME_FILE) as file:
        return HexMesh(file["nodes"], file["elements"], file["regions"], tuple(answer.value))
