"""Hexahedra of a volume mesh by meshio, for a process of its own: see :mod:`warpjld.io.meshio_process`."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.io.meshio_end import stop_at_end

__all__ = ["VOLUME_FILE", "leave_volume_mesh"]

VOLUME_FILE = "mesh.npz"
"""File that is left, with ``nodes``, ``elements`` and ``regions``."""
_CORNERS = {  # nodes of a (degenerate) hexahedron, as indices into the cell's nodes
    "hexahedron": [0, 1, 2, 3, 4, 5, 6, 7],
    "wedge": [0, 1, 2, 2, 3, 4, 5, 5],
    "tetra": [0, 1, 2, 2, 3, 3, 3, 3],
}


def leave_volume_mesh(folder: Path, path: Path, scale: float) -> list[str]:
    """Write nodes, elements and regions of a mesh to the folder, and return the names of its regions.

    Raises:
        InputError: meshio cannot read it, or it has no volume elements.
    """
    import meshio

    stop_at_end()
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):  # meshio prints what is wrong, and exits
            read = meshio.read(path)
    except MemoryError:
        raise
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
    arrays = {"elements": corners.reshape(-1, 8).astype(np.int32), "regions": regions.astype(np.int32)}
    np.savez(folder / VOLUME_FILE, nodes=points, **arrays)  # type: ignore[arg-type]
    return [names.get(int(v), "body" if len(values) == 1 else f"region{int(v)}") for v in values]
