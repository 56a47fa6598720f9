"""Concatenation of the meshes of a rig file to one surface with its skin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.surface import Part, one_uv_a_vertex

__all__ = ["RigMesh", "joined"]


@dataclass(frozen=True, eq=False)
class RigMesh:
    """One mesh in the file's world at rest; joints are indices into its tree.

    Attributes:
        name: Name of the mesh.
        vertices: Positions, shape (W, 3).
        faces: Triangles, shape (S, 3).
        joints: Influencing joints, shape (W, K).
        weights: Their weights, rows summing to one, shape (W, K).
        rigid: Joint that the whole mesh follows rigidly, -1 if deformable.
        uv: Texture coordinates of the vertices, shape (W, 2), or None.
        corner_uv: Texture coordinates of the triangles' corners, if a vertex has several, shape (S, 3, 2), or None.
        polygons: Polygon that each triangle is part of, shape (S,), or None if all polygons are triangles.
        polygon_count: Number of polygons in the file, including those without triangles.
        texture: Encoded image of its base colour texture, or None.
    """

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    joints: NDArray[np.int64]
    weights: NDArray[np.float64]
    rigid: int = -1
    uv: NDArray[np.float32] | None = None
    corner_uv: NDArray[np.float32] | None = None
    polygons: NDArray[np.int64] | None = None
    polygon_count: int = 0
    texture: bytes | None = None


def joined(meshes: Sequence[RigMesh]) -> dict[str, Any]:
    """Fields of a :class:`~warpjld.io.source.SourceRig`: concatenated vertices, faces, texture coordinates, parts and
    skins. Meshes without texture coordinates get zeros if others have some."""
    vertex = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    face = np.cumsum([0, *(len(mesh.faces) for mesh in meshes)])
    faces = np.concatenate([mesh.faces + vertex[m] for m, mesh in enumerate(meshes)])
    uv = _filled([mesh.uv for mesh in meshes], [(len(mesh.vertices), 2) for mesh in meshes])
    corner_uv = _filled([mesh.corner_uv for mesh in meshes], [(*mesh.faces.shape, 2) for mesh in meshes])
    if corner_uv is not None:
        uv, corner_uv = one_uv_a_vertex(int(vertex[-1]), faces, corner_uv)
    polygons, known = [], 0
    for mesh in meshes:
        own = np.arange(len(mesh.faces)) if mesh.polygons is None else mesh.polygons
        polygons.append(own + known)
        known += len(mesh.faces) if mesh.polygons is None else mesh.polygon_count
    width = max(mesh.joints.shape[1] for mesh in meshes)
    return {
        "vertices": np.concatenate([mesh.vertices for mesh in meshes]),
        "faces": faces,
        "uv": uv,
        "corner_uv": corner_uv,
        "parts": tuple(
            Part(
                mesh.name,
                slice(int(vertex[m]), int(vertex[m + 1])),
                slice(int(face[m]), int(face[m + 1])),
                mesh.texture,
            )
            for m, mesh in enumerate(meshes)
        ),
        "polygons": None if all(mesh.polygons is None for mesh in meshes) else np.concatenate(polygons),
        "joints": np.concatenate([_widened(mesh.joints, width) for mesh in meshes]),
        "weights": np.concatenate([_widened(mesh.weights, width) for mesh in meshes]),
        "rigid": np.concatenate([np.full(len(mesh.vertices), mesh.rigid) for mesh in meshes]),
    }


def _filled(
    arrays: Sequence[NDArray[np.float32] | None], shapes: Sequence[tuple[int, ...]]
) -> NDArray[np.float32] | None:
    if all(array is None for array in arrays):
        return None
    pairs = zip(arrays, shapes, strict=True)
    return np.concatenate([np.zeros(shape, np.float32) if array is None else array for array, shape in pairs])


def _widened(array: NDArray[Any], width: int) -> NDArray[Any]:
    return np.pad(array, ((0, 0), (0, width - array.shape[1])))
