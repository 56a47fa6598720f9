"""Reader of surfaces without joints: OBJ, PLY, OFF and glTF; STL and other formats by trimesh."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.files.input_file import check_input
from warpjld.files.reading import reading
from warpjld.geometry.surface import Part, one_uv_a_vertex
from warpjld.io.by_trimesh import BY_TRIMESH, load_trimesh_surface
from warpjld.io.obj_file import read_obj
from warpjld.io.obj_material import obj_textures
from warpjld.io.off_file import read_off
from warpjld.io.ply_file import PlyFile, read_ply
from warpjld.io.polygons import triangulate_polygons
from warpjld.io.rig_meshes import joined
from warpjld.limits import check_limit

__all__ = ["MeshFile", "read_mesh"]


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A surface in the file's own vertex order, unit and axes.

    Attributes:
        path: The file.
        vertices: Positions, shape (W, 3).
        faces: Triangles, shape (S, 3); larger polygons are split.
        uv: Texture coordinates, shape (W, 2), or None.
        corner_uv: Texture coordinates of the triangles' corners, shape (S, 3, 2), instead of ``uv`` if a vertex has
            several.
        parts: The file's meshes.
        notes: Repairs, for the user.
        polygons: Polygon of the file that each triangle is part of, shape (S,); None if all polygons are
            triangles.
    """

    path: Path
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    uv: NDArray[np.float32] | None
    corner_uv: NDArray[np.float32] | None
    parts: tuple[Part, ...]
    notes: tuple[str, ...] = ()
    polygons: NDArray[np.int64] | None = None


def read_mesh(path: str | Path) -> MeshFile:
    """Read all triangle meshes of a file, placed by its scene graph.

    Raises:
        InputError: Unreadable, of an unknown format, without triangles, or not finite.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (*_READERS, *BY_TRIMESH):
        known = ", ".join((*_READERS, *BY_TRIMESH))
        raise InputError(f"'{path.suffix}' is not a kind of surface file that can be read; known: {known}", path=path)
    check_input(path)
    with reading(path, kind.lstrip(".").upper()):
        file = _READERS.get(kind, _by_trimesh)(path)
        check_limit("vertices", len(file.vertices))
        check_limit("faces", len(file.faces))
        _check_finite(file.vertices, path)
    return file


def _obj(path: Path) -> MeshFile:
    file = read_obj(path)
    uv, corner_uv = one_uv_a_vertex(len(file.vertices), file.faces, file.corner_uv)
    used = [name for name, _ in file.materials] if file.corner_uv is not None else []
    pictures, note = obj_textures(path.parent, file.libraries if used else (), used)
    parts = tuple(replace(part, painted=_painted(part, file.materials, pictures)) for part in file.parts)
    notes = (*file.notes, *([note] if note else []))
    return MeshFile(path, file.vertices, file.faces, uv, corner_uv, parts, notes, file.polygons)


def _painted(
    part: Part, materials: tuple[tuple[str, slice], ...], pictures: Mapping[str, bytes]
) -> tuple[tuple[slice, bytes], ...]:
    """Textures of a part's triangles, by ranges; ``pictures`` by the names of materials."""
    out = []
    for name, run in materials:
        both = slice(max(run.start, part.faces.start), min(run.stop, part.faces.stop))
        if name in pictures and both.stop > both.start:
            out.append((both, pictures[name]))
    return tuple(out)


def _gltf(path: Path) -> MeshFile:
    from warpjld.io.gltf.surface import read_gltf_surface

    found = joined(read_gltf_surface(path))
    return MeshFile(path, found["vertices"], found["faces"], found["uv"], found["corner_uv"], found["parts"])


def _by_trimesh(path: Path) -> MeshFile:
    found = load_trimesh_surface(path)
    return MeshFile(path, found.vertices, found.faces, found.uv, None, found.parts)


def _of_polygons(path: Path, file: PlyFile) -> MeshFile:
    triangles, polygons = triangulate_polygons(file.vertices[file.corners], file.counts)
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
    return MeshFile(path, file.vertices, faces, uv, corner_uv, whole, tuple(notes), polygons)


_READERS: dict[str, Callable[[Path], MeshFile]] = {
    ".obj": _obj,
    ".ply": lambda path: _of_polygons(path, read_ply(path)),
    ".off": lambda path: _of_polygons(path, PlyFile(*read_off(path), None, None)),
    ".glb": _gltf,
    ".gltf": _gltf,
    ".vrm": _gltf,
}


def _check_finite(vertices: NDArray[np.float64], path: Path) -> None:
    if not np.isfinite(vertices).all():
        raise InputError(f"vertex {int(np.argwhere(~np.isfinite(vertices))[0][0])} is not finite", path=path)
