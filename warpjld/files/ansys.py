"""Recognition of ANSYS meshes, which meshio reads without end where they are damaged."""

from __future__ import annotations

from pathlib import Path

from warpjld.errors import InputError
from warpjld.files.input_file import open_input

__all__ = ["refuse_ansys"]


def refuse_ansys(path: Path) -> None:
    """Refuse a ``.msh`` file of ANSYS; Gmsh's begin with ``$``.

    Raises:
        InputError: It is one, or cannot be read.
    """
    with open_input(path) as file:
        if path.suffix.lower() == ".msh" and file.read(64).lstrip().startswith(b"("):
            raise InputError(
                "is an ANSYS mesh, whose reader never ends on a damaged one: save as Gmsh or VTK", path=path
            )
