"""Reader of volume meshes of other programs, by meshio."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from warpjld.errors import InputError, MissingExtraError
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.io.meshio_process import with_meshio

__all__ = ["leave_volume_mesh", "read_volume_mesh"]

_FILE = "mesh.npz"

_CORNERS = {  # nodes of a (degenerate) hexahedron, as indices into the cell's nodes
    "hexahedron": [0, 1, 2, 3, 4, 5, 6, 7],
    "wedge": [0, 1, 2, 2, 3, 4, 5, 5],
    "tetra": [0, 1, 2, 2, 3, 3, 3, 3],
}


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
    here = ("warpjld.fem.mesh.exchange", "leave_volume_mesh")
    with with_meshio(here, path, "a volume mesh", scale) as answer, np.load(answer.folder / _FILE) as file:
        return HexMesh(file["nodes"], file["elements"], file["regions"], tuple(answer.value))


def leave_volume_mesh(folder: Path, path: Path, scale: float) -> list[str]:
    """In the process: write the arrays of a mesh to the folder, and return the names of its regions."""
    mesh = _read(path, scale)
    np.savez(folder / _FILE, nodes=mesh.nodes, elements=mesh.elements, regions=mesh.regions)
    return list(mesh.region_names)


def _read(path: Path, scale: float) -> HexMesh:
    import meshio

    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):  # meshio prints what is wrong, and exits
            read = meshio.read(path)
    except (Exception, SystemExit) as error:
        told = " ".join(said.getvalue().split())[:300] if isinstance(error, SystemExit) else error
        raise InputError(f"meshio cannot read it: {told}", path=path) from error
    elements, marks = [], []
    label = next((name for name in ("region", "gmsh:physical", "medit:ref") if name in read.cell_data), None)
    for number, block in enumerate(read.cells):
        if block.type not in _CORNERS:
            continue
        elements.append(block.data[:, _CORNERS[block.type]])
        found = np.zeros(len(block.data)) if label is None else np.asarray(read.cell_data[label][number])
        marks.append(found.astype(np.int64))
    if not elements:
        kinds = ", ".join(sorted({block.type for block in read.cells})) or "nothing"
        raise InputError(f"has no hexahedra, prisms or tetrahedra, only {kinds}", path=path)
    used, corners = np.unique(np.concatenate(elements), return_inverse=True)
    points = np.zeros((len(used), 3))
    points[:, : read.points.shape[1]] = scale * read.points[used]
    values, regions = np.unique(np.concatenate(marks), return_inverse=True)
    names = {int(data[0]): name for name, data in read.field_data.items()}
    return HexMesh(
        points,
        corners.reshape(-1, 8).astype(np.int32),
        regions.astype(np.int32),
        tuple(names.get(int(v), "body" if len(values) == 1 else f"region{int(v)}") for v in values),
    )
