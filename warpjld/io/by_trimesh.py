"""Surfaces by trimesh; those formats that it leaves to meshio in a process of their own."""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.archive import check_archive
from warpjld.geometry.surface import Part
from warpjld.io.meshio_end import stop_at_end
from warpjld.io.meshio_process import with_meshio
from warpjld.limits import check_limit

__all__ = ["BY_TRIMESH", "TrimeshSurface", "leave_trimesh_surface", "load_trimesh_surface"]

_BY_MESHIO = (".vtk", ".vtu", ".msh", ".mesh", ".inp", ".nas", ".bdf")
BY_TRIMESH = (".stl", ".stl_ascii", ".3mf", ".dae", *_BY_MESHIO)
"""trimesh's surface formats; its readers of archives and drawings are excluded, as these open any file named inside."""
_FILE = "surface.npz"


@dataclass(frozen=True, eq=False)
class TrimeshSurface:
    """Triangles of all meshes of a file, placed by its scene graph.

    Attributes:
        vertices: Positions, shape (W, 3).
        faces: Triangles, shape (S, 3).
        uv: Texture coordinates, shape (W, 2), or None.
        parts: The file's meshes.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    parts: tuple[Part, ...]


def load_trimesh_surface(path: Path) -> TrimeshSurface:
    """Read a surface in one of the formats ``BY_TRIMESH``.

    Raises:
        InputError: Unreadable, or without triangles; or meshio exceeded a limit.
    """
    import trimesh

    kind = path.suffix.lower()
    if kind.lstrip(".") not in trimesh.available_formats():
        raise InputError(
            f"{kind.lstrip('.').upper()} files need packages that trimesh reads them with: save as STL, OBJ or PLY"
        )
    if kind not in _BY_MESHIO:
        return _surface(path)
    here = ("warpjld.io.by_trimesh", "leave_trimesh_surface")
    with with_meshio(here, path, kind.lstrip(".").upper()) as answer:
        with np.load(answer.folder / _FILE) as file:
            arrays = dict(file)
        parts = tuple(Part(name, slice(*vertices), slice(*faces)) for name, vertices, faces in answer.value)
    return TrimeshSurface(arrays["vertices"], arrays["faces"], arrays.get("uv"), parts)


def leave_trimesh_surface(folder: Path, path: Path) -> list[Any]:
    """In the process: write the arrays of a surface to the folder, and return its parts."""
    stop_at_end()
    found = _surface(path)
    arrays = {"vertices": found.vertices, "faces": found.faces} | ({} if found.uv is None else {"uv": found.uv})
    np.savez(folder / _FILE, **arrays)  # type: ignore[arg-type]
    return [
        (part.name, (part.vertices.start, part.vertices.stop), (part.faces.start, part.faces.stop))
        for part in found.parts
    ]


def _surface(path: Path) -> TrimeshSurface:
    import trimesh

    if path.suffix.lower() == ".3mf":
        check_archive(path)
    # not load_scene, which trimesh 4.5 does not have yet
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):  # its readers print, and meshio's exit
            loaded = trimesh.load(path, process=False, force="scene")
    except SystemExit as error:
        raise InputError(" ".join(said.getvalue().split())[:300], path=path) from error
    scene = loaded if isinstance(loaded, trimesh.Scene) else trimesh.Scene(loaded)
    vertices, faces, uvs, parts = [], [], [], []
    points = triangles = 0
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        check_limit("vertices", points + len(mesh.vertices), path=path)
        vertices.append(mesh.vertices @ transform[:3, :3].T + transform[:3, 3])
        turned = np.linalg.det(transform[:3, :3]) < 0  # a mirroring node inverts its triangles
        faces.append((mesh.faces[:, ::-1] if turned else mesh.faces) + points)
        uvs.append(getattr(mesh.visual, "uv", None))
        ends = points + len(mesh.vertices), triangles + len(mesh.faces)
        parts.append(Part(str(key), slice(points, ends[0]), slice(triangles, ends[1])))
        points, triangles = ends
    if not parts:
        raise InputError("has no triangles", path=path)
    everything = np.concatenate(vertices).astype(np.float64)
    return TrimeshSurface(everything, np.concatenate(faces).astype(np.int64), _uv(uvs, parts), tuple(parts))


def _uv(uvs: list[NDArray[np.float64] | None], parts: list[Part]) -> NDArray[np.float32] | None:
    if all(uv is None for uv in uvs):
        return None
    sizes = [part.vertices.stop - part.vertices.start for part in parts]
    filled = [np.zeros((n, 2)) if uv is None or len(uv) != n else uv for uv, n in zip(uvs, sizes, strict=True)]
    return np.concatenate(filled).astype(np.float32)
