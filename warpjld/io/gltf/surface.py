"""Reader of the meshes of a glTF file without joints, for objects and for surfaces with a separate skeleton file.

Own reader, on the validated accessors that rigs are read with: trimesh's uses strides and offsets unchecked, and a
negative one reads memory outside of the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from warpjld.errors import InputError
from warpjld.io.gltf.document import Document, open_document
from warpjld.io.gltf.texture import base_color_picture, texture_coordinates
from warpjld.io.gltf.triangles import is_surface, primitive_points, primitive_triangles
from warpjld.io.rig_meshes import RigMesh
from warpjld.limits import check_limit

__all__ = ["read_gltf_surface"]


def read_gltf_surface(path: str | Path) -> list[RigMesh]:
    """Meshes of the default scene, placed by their nodes, one per instance; joints and skins are ignored.

    Triangles that a node mirrors are flipped, so that they stay anticlockwise seen from outside.

    Raises:
        InputError: Not glTF, invalid data, or no triangles.
    """
    document = open_document(path)
    with document.reading():
        meshes = _meshes(document)
    if not meshes:
        raise InputError("has no triangles", path=document.path)
    return meshes


def _meshes(document: Document) -> list[RigMesh]:
    gltf, out = document.gltf, []
    vertices = 0
    for node in sorted(document.shown):
        number = gltf.nodes[node].mesh
        if number is None:
            continue
        if not 0 <= number < len(gltf.meshes):
            raise InputError(f"node '{document.name(node)}': mesh {number} does not exist", path=document.path)
        world = document.worlds[node]
        mirrored = np.linalg.det(world[:3, :3]) < 0.0
        name = gltf.meshes[number].name or document.name(node)
        for primitive in gltf.meshes[number].primitives:
            if not is_surface(primitive):
                continue
            points = primitive_points(document, primitive, node, name)
            faces = primitive_triangles(document, primitive, len(points), name)
            if not len(faces):
                continue
            vertices += len(points)
            check_limit("vertices", vertices, path=document.path)
            out.append(
                RigMesh(
                    name,
                    points @ world[:3, :3].T + world[:3, 3],
                    faces[:, ::-1] if mirrored else faces,
                    np.zeros((len(points), 1), dtype=np.int64),
                    np.ones((len(points), 1)),
                    uv=texture_coordinates(document, primitive, len(points), name),
                    texture=base_color_picture(document, primitive),
                )
            )
    return out
