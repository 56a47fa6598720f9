"""Reader of skinned meshes of glTF files as :class:`SourceRig`: joints of all skins, meshes as displayed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.io.gltf.document import Document, open_document
from warpjld.io.gltf.influences import read_gltf_influences
from warpjld.io.gltf.texture import base_color_picture, texture_coordinates
from warpjld.io.gltf.triangles import is_surface, primitive_points, primitive_triangles
from warpjld.io.rig_meshes import RigMesh, joined
from warpjld.io.source import SourceRig
from warpjld.skeleton.recognise.tree import SourceTree

__all__ = ["joint_nodes", "joint_tree", "read_gltf_rig"]

_BIND_TOLERANCE = 1e-4  # largest difference of bind and displayed pose that count as equal, per size of the surface


def read_gltf_rig(path: str | Path) -> SourceRig:
    """Read the skinned meshes of a glTF file.

    Vertices are placed by joint · inverse bind matrix: a skinned mesh's own node transform is ignored (glTF 2.0
    §3.7.3.3). Meshes without a skin below a joint follow it rigidly; others are left out, with a note, as are meshes
    outside the default scene. Morph targets are applied at their default weights. Faces that a transform mirrors are
    flipped, so that they stay anticlockwise seen from outside.

    Raises:
        InputError: Not glTF, no skin, or invalid skin data.
    """
    document = open_document(path)
    with document.reading():
        return _read(document)


def _read(document: Document) -> SourceRig:
    gltf = document.gltf
    if not gltf.skins:
        raise InputError(
            "has no skin (no joints): give a rigged file, or a skeleton file for this surface", path=document.path
        )
    nodes = joint_nodes(document)
    number = {node: j for j, node in enumerate(nodes)}
    tree = joint_tree(document, nodes)
    flattened = {n: number.keys() & set(_subtree(document, n)) for n in document.flattened}
    for n, collapsed in flattened.items():
        if len(collapsed) == len(nodes):
            raise InputError(f"node '{document.name(n)}': scale 0 at rest collapses all joints", path=document.path)
    notes: list[str] = []
    placed: list[tuple[RigMesh, float]] = []
    for node in _mesh_nodes(document, notes):
        name = gltf.meshes[gltf.nodes[node].mesh].name or document.name(node)
        placed += _mesh(document, node, number, name, notes)
    if not placed:
        raise InputError("no mesh uses the skin", path=document.path)
    surface = joined([mesh for mesh, _ in placed])
    if max(moved for _, moved in placed) > _BIND_TOLERANCE * np.linalg.norm(np.ptp(surface["vertices"], axis=0)):
        notes.append("bind pose differs from the pose the file shows: the shown pose is used as rest pose")
    return SourceRig(
        path=document.path,
        tree=tree,
        **surface,
        notes=tuple(notes),
        suspicious=tuple(
            f"node '{document.name(n)}': scale 0 at rest: what hangs on it is collapsed, and stays so when moved"
            for n, collapsed in flattened.items()
            if collapsed
        ),
    )


def _mesh_nodes(document: Document, notes: list[str]) -> list[int]:
    """Nodes with meshes in the default scene; those of all scenes if that one shows no skinned mesh."""
    gltf = document.gltf
    holders = [n for n, record in enumerate(gltf.nodes) if record.mesh is not None]
    for n in holders:
        if not 0 <= gltf.nodes[n].mesh < len(gltf.meshes):
            raise InputError(f"node '{document.name(n)}': mesh {gltf.nodes[n].mesh} does not exist", path=document.path)
    skinned = [n for n in holders if gltf.nodes[n].skin is not None]
    if skinned and not document.shown.intersection(skinned):
        notes.append("its default scene shows no skinned mesh: those of all scenes are taken")
        return holders
    hidden = sorted({document.name(n) for n in holders if n not in document.shown})
    if hidden:
        notes.append(f"not in the default scene, left out: {', '.join(hidden)}")
    return [n for n in holders if n in document.shown]


def _subtree(document: Document, node: int) -> list[int]:
    """A node and all its descendants."""
    out = [node]
    for n in out:
        out.extend(document.gltf.nodes[n].children or ())
    return out


def joint_nodes(document: Document) -> list[int]:
    """Indices of nodes that are joints of any skin, in the skins' order.

    Raises:
        InputError: A skin without joints, or with one that does not exist.
    """
    nodes: dict[int, None] = {}
    for i, skin in enumerate(document.gltf.skins):
        if not skin.joints:
            raise InputError(f"skin {i} has no joints", path=document.path)
        for node in skin.joints:
            if not 0 <= node < len(document.gltf.nodes):
                raise InputError(f"skin {i}: joint node {node} does not exist", path=document.path)
            nodes[node] = None
    return list(nodes)


def joint_tree(document: Document, nodes: list[int]) -> SourceTree:
    """These nodes as a joint tree, in the displayed pose."""
    number = {node: j for j, node in enumerate(nodes)}
    parents = np.full(len(nodes), -1)
    for j, node in enumerate(nodes):
        above = int(document.parents[node])
        while above >= 0 and above not in number:
            above = int(document.parents[above])
        parents[j] = number.get(above, -1)
    return SourceTree(tuple(document.name(n) for n in nodes), parents, document.worlds[nodes])


def _mesh(
    document: Document, node: int, number: dict[int, int], name: str, notes: list[str]
) -> list[tuple[RigMesh, float]]:
    """The primitives of a mesh, each with the largest distance between displayed and bind pose."""
    gltf = document.gltf
    record = gltf.nodes[node]
    if record.skin is not None:
        skin = gltf.skins[record.skin]
        joints = np.array([number[n] for n in skin.joints])
        transforms = document.worlds[skin.joints] @ _inverse_binds(document, record.skin)
    else:
        above = node
        while above >= 0 and above not in number:
            above = int(document.parents[above])
        if above < 0:
            notes.append(f"mesh '{name}' has no skin and hangs on no joint: left out")
            return []
        notes.append(f"mesh '{name}' has no skin: it follows joint '{document.name(above)}' rigidly")
        joints, transforms = np.array([number[above]]), document.worlds[[node]]
    out = []
    for primitive in gltf.meshes[record.mesh].primitives:
        if not is_surface(primitive):
            notes.append(f"mesh '{name}': points or lines left out")
            continue
        read = _primitive(document, primitive, joints, transforms, name, node, notes)
        if len(read[0].faces):
            out.append(read)
    return out


def _primitive(
    document: Document,
    primitive: Any,
    joints: NDArray[np.int64],
    transforms: NDArray[np.float64],
    name: str,
    node: int,
    notes: list[str],
) -> tuple[RigMesh, float]:
    points = primitive_points(document, primitive, node, name)
    faces = primitive_triangles(document, primitive, len(points), name)
    skinned = document.gltf.nodes[node].skin is not None
    if skinned:
        indices, weights = read_gltf_influences(
            document, vars(primitive.attributes), points, faces, len(joints), name, notes
        )
    else:
        indices, weights = np.zeros((len(points), 1), dtype=np.int64), np.ones((len(points), 1))
    blended = np.einsum("vk,vkij->vij", weights, transforms[indices])
    placed = np.einsum("vij,vj->vi", blended[:, :3, :3], points) + blended[:, :3, 3]
    mirrored = np.linalg.det(blended[:, :3, :3]) < 0.0
    over = mirrored[faces].sum(axis=1) >= 2
    faces[over] = faces[over][:, ::-1]
    # a common rigid motion of the mesh is a placement; different ones mean that the displayed pose is not the bind pose
    rigid = transforms[0]
    moved = float(np.abs(placed - (points @ rigid[:3, :3].T + rigid[:3, 3])).max(initial=0.0))
    uv = texture_coordinates(document, primitive, len(points), name)
    follows = -1 if skinned else int(joints[0])
    picture = base_color_picture(document, primitive)
    return RigMesh(name, placed, faces, joints[indices], weights, follows, uv=uv, texture=picture), moved


def _inverse_binds(document: Document, index: int) -> NDArray[np.float64]:
    skin = document.gltf.skins[index]
    if skin.inverseBindMatrices is None:
        return np.tile(np.eye(4), (len(skin.joints), 1, 1))
    matrices = document.accessor(skin.inverseBindMatrices).astype(np.float64)
    if matrices.shape[1:] != (4, 4) or len(matrices) < len(skin.joints):
        raise InputError(
            f"skin {index}: {len(skin.joints)} joints need as many inverse bind matrices, got {len(matrices)}",
            path=document.path,
        )
    if not np.isfinite(matrices).all():
        raise InputError(f"skin {index}: an inverse bind matrix is not finite", path=document.path)
    return matrices[: len(skin.joints)]
