"""Results as ParaView files: a ``.vtu`` per instant and a ``.pvd`` that lists them."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from warpjld.fem.body import Body
from warpjld.fem.mesh.hexmesh import HexMesh
from warpjld.fem.output.stress import at_nodes, cauchy, mises
from warpjld.fem.solver.solution import Instant
from warpjld.files.whole_file import whole_file

__all__ = ["Series", "grid_of", "write_vtu"]


def grid_of(mesh: HexMesh) -> Any:
    """The mesh as ``pyvista.UnstructuredGrid``, regions as cell data."""
    import pyvista

    cells = np.concatenate([np.full((len(mesh.elements), 1), 8, np.int64), mesh.elements], axis=1)
    kinds = np.full(len(mesh.elements), pyvista.CellType.HEXAHEDRON, np.uint8)
    grid = pyvista.UnstructuredGrid(cells.ravel(), kinds, mesh.nodes)
    grid.cell_data["region"] = mesh.regions
    return grid


def write_vtu(path: Path, body: Body, instant: Instant) -> None:
    """Write one instant: rest nodes with displacement, reaction and von Mises stress; stress and region of cells."""
    grid = grid_of(body.mesh)
    stress = cauchy(body, instant.displacement)
    point, cell = grid.point_data, grid.cell_data
    point["displacement"] = instant.displacement
    point["reaction"] = instant.reactions
    point["mises"] = at_nodes(body, mises(stress))
    cell["stress"] = stress
    cell["mises"] = mises(stress)
    with whole_file(path) as part:
        grid.save(part)


class Series:
    """A time series of ``.vtu`` files that is readable after every instant.

    Args:
        path: The ``.pvd`` file; the ``.vtu`` files are written beside it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._entries: list[tuple[float, str]] = []

    def add(self, time: float, body: Body, instant: Instant) -> Path:
        """Write an instant and list it at ``time``; returns the ``.vtu`` file."""
        name = f"{self.path.stem}_{len(self._entries):04d}.vtu"
        write_vtu(self.path.with_name(name), body, instant)
        self._entries.append((time, name))
        lines = "\n".join(f'    <DataSet timestep="{t:g}" part="0" file={quoteattr(n)}/>' for t, n in self._entries)
        text = (
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
            f"  <Collection>\n{lines}\n  </Collection>\n</VTKFile>\n"
        )
        with whole_file(self.path) as part:
            part.write_text(text)
        return self.path.with_name(name)
