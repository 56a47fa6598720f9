"""Surfaces without joints: OBJ, PLY and OFF, and STL, glTF and whatever else trimesh reads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.obj_file import read_obj
from warpjld.io.off_file import read_off
from warpjld.io.ply_file import PlyFile, read_ply
from warpjld.io.polygons import triangulate_polygons
from warpjld.surface import Part, one_uv_a_vertex

__all__ = ["MeshFile", "read_mesh"]


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A surface in the file's own vertex order, unit and axes.

    Attributes:
        path: The file.
        vertices: Positions, shape (W, 3).
        faces: Triangles, shape (S, 3); larger polygons are split.
        uv: Texture coordinates, shape (W, 2), or None.
        corner_uv: Texture coordinates of the triangles' corners, shape (S, 3, 2), instead of ``uv`` where some vertex
            has several.
        parts: The file's meshes.
        notes: What was mended on the way.
    """

    path: Path
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    corner_uv: NDArray[np.float32] | None
    parts: tuple[Part, ...]
    notes: tuple[str, ...] = ()


def read_mesh(path: str | Path) -> MeshFile:
    """Read all triangle meshes of a file, placed as its scene says.

    Raises:
        InputError: Unreadable, of an unknown kind, without triangles, or not finite.
    """
    import trimesh

    path = Path(path)
    if not path.is_file():
        raise InputError("no such file", path=path)
    if path.suffix.lower() == ".obj":
        file = read_obj(path)
        uv, corner_uv = one_uv_a_vertex(len(file.vertices), file.faces, file.corner_uv)
        return MeshFile(path, file.vertices, file.faces, uv, corner_uv, file.parts, file.notes)
    if path.suffix.lower() == ".ply":
        return _of_polygons(path, read_ply(path))
    if path.suffix.lower() == ".off":
        return _of_polygons(path, PlyFile(*read_off(path), None, None))
    if path.suffix.lower().lstrip(".") not in trimesh.available_formats():
        raise InputError(f"'{path.suffix}' is not a kind of surface file that can be read", path=path)
    try:
        scene = trimesh.load_scene(path, process=False)
    except Exception as error:  # trimesh raises whatever its many readers raise
        raise InputError(f"cannot be read as {path.suffix.lstrip('.').upper()}: {error}", path=path) from None
    vertices, faces, uvs, parts = [], [], [], []
    points = triangles = 0
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        vertices.append(mesh.vertices @ transform[:3, :3].T + transform[:3, 3])
        turned = np.linalg.det(transform[:3, :3]) < 0  # a mirrored node turns its triangles inside out
        faces.append((mesh.faces[:, ::-1] if turned else mesh.faces) + points)
        uvs.append(getattr(mesh.visual, "uv", None))
        ends = points + len(mesh.vertices), triangles + len(mesh.faces)
        parts.append(Part(str(key), slice(points, ends[0]), slice(triangles, ends[1])))
        points, triangles = ends
    if not parts:
        raise InputError("has no triangles", path=path)
    everything = np.concatenate(vertices).astype(np.float64)
    _check_finite(everything, path)
    return MeshFile(path, everything, np.concatenate(faces).astype(np.int64), _uv(uvs, parts), None, tuple(parts))


def _uv(uvs: list[NDArray[np.float64] | None], parts: list[Part]) -> NDArray[np.float32] | None:
    if all(uv is None for uv in uvs):
        return None
    sizes = [part.vertices.stop - part.vertices.start for part in parts]
    filled = [np.zeros((n, 2)) if uv is None or len(uv) != n else uv for uv, n in zip(uvs, sizes, strict=True)]
    return np.concatenate(filled).astype(np.float32)


def _of_polygons(path: Path, file: PlyFile) -> MeshFile:
    _check_finite(file.vertices, path)
    triangles, _ = triangulate_polygons(file.vertices[file.corners], file.counts)
    if not len(triangles):
        raise InputError("has no triangles", path=path)
    faces = file.corners[triangles]
    uv, corner_uv = file.uv, None
    if file.corner_uv is not None:
        uv, corner_uv = one_uv_a_vertex(len(file.vertices), faces, file.corner_uv[triangles])
    notes = []
    if not all(np.isfinite(found).all() for found in (uv, corner_uv) if found is not None):
        uv, corner_uv = None, None
        notes.append("texture coordinates are not finite: left out")
    few = int((file.counts < 3).sum())
    if few:
        notes.append(f"{few} faces with fewer than three corners left out")
    whole = (Part(path.stem, slice(0, len(file.vertices)), slice(0, len(faces))),)
    return MeshFile(path, file.vertices, faces, uv, corner_uv, whole, tuple(notes))


def _check_finite(vertices: NDArray[np.float64], path: Path) -> None:
    if not np.isfinite(vertices).all():
        raise InputError(f"vertex {int(np.argwhere(~np.isfinite(vertices))[0][0])} is not finite", path=path)
