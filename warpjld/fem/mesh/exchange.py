"""Volume meshes from and to the files of other programs (meshio)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError, MissingExtraError
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.whole_file import whole_file

__all__ = ["read_mesh", "write_mesh"]

_CORNERS = {  # corners of our element, by the corners of theirs
    "hexahedron": [0, 1, 2, 3, 4, 5, 6, 7],
    "wedge": [0, 1, 2, 2, 3, 4, 5, 5],
    "tetra": [0, 1, 2, 2, 3, 3, 3, 3],
}
_SUFFIXES = (".vtk", ".vtu", ".msh", ".inp", ".med", ".xdmf", ".mesh", ".bdf", ".nas", ".unv", ".exo", ".e")


def read_mesh(path: Path, *, scale: float = 1.0) -> HexMesh:
    """Read hexahedra, prisms and tetrahedra (the last two as degenerate hexahedra, R96); other cells are left out.

    Regions come from ``region``, ``gmsh:physical`` or ``medit:ref`` cell data, where there is one.

    Args:
        path: File in any format of meshio.
        scale: Metres per unit of the file.

    Raises:
        InputError: Unreadable, or without volume elements.
        MissingExtraError: meshio is not installed.
    """
    meshio = _meshio()
    if not path.is_file():
        raise InputError("no such file", path=path)
    try:
        read = meshio.read(path)
    except (Exception, SystemExit) as error:
        raise InputError(f"meshio cannot read it: {error}", path=path) from error
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


def write_mesh(path: Path, mesh: HexMesh, point_data: dict[str, NDArray[Any]] | None = None) -> None:
    """Write a mesh in the format of the suffix, regions as cell data ``region``.

    Raises:
        InputError: A suffix meshio does not write.
        MissingExtraError: meshio is not installed.
    """
    meshio = _meshio()
    if path.suffix.lower() not in _SUFFIXES:
        raise InputError(f"suffix '{path.suffix}': want one of {', '.join(_SUFFIXES)}", path=path)
    out = meshio.Mesh(
        mesh.nodes, [("hexahedron", mesh.elements)], point_data=point_data or {}, cell_data={"region": [mesh.regions]}
    )
    with whole_file(path) as part:
        meshio.write(part, out)


def _meshio() -> Any:
    try:
        import meshio
    except ImportError as error:
        raise MissingExtraError("reading and writing volume meshes", "mesh") from error
    return meshio
