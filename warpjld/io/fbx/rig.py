"""Reader of skinned meshes of FBX files as :class:`SourceRig`."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from warpjld.errors import InputError
from warpjld.files.input_file import read_bytes
from warpjld.io.fbx.scene import FbxMesh, FbxScene, FbxSkin, read_scene
from warpjld.io.fbx.skeleton import FbxSkeleton, find_skeleton
from warpjld.io.gltf.schema import inside_folder
from warpjld.io.polygons import triangulate_polygons
from warpjld.io.rig_meshes import RigMesh, joined
from warpjld.io.source import SourceRig

__all__ = ["read_fbx_rig"]

_BIND_TOLERANCE = 1e-4  # largest difference of two placements of a mesh that count as one, per size of the surface


def read_fbx_rig(path: str | Path) -> SourceRig:
    """Read the meshes of an FBX file that are skinned or parented to a joint, in metres and Y up.

    The rest pose is the bind pose. Vertices are the file's control points, in its order. Meshes without a skin below a
    joint follow it rigidly; others are left out, with a note.

    Raises:
        InputError: Not FBX, no skin, or invalid data.
        MissingExtraError: Without ufbx.
    """
    scene = read_scene(path)
    if not any(mesh.skin for mesh in scene.meshes) and not any(kind == "bone" for kind in scene.kinds):
        raise InputError(
            "has no skin (no joints): give a rigged file, or a skeleton file for this surface", path=scene.path
        )
    skeleton = find_skeleton(scene)
    notes = [*scene.notes, *skeleton.notes]
    placed = [found for mesh in scene.meshes if (found := _place(scene, skeleton, mesh, notes)) is not None]
    if not placed:
        raise InputError("no mesh is bound to its joints", path=scene.path)
    return SourceRig(
        path=scene.path,
        tree=skeleton.tree,
        **joined(placed),
        notes=tuple(notes),
    )


def _place(scene: FbxScene, skeleton: FbxSkeleton, mesh: FbxMesh, notes: list[str]) -> RigMesh | None:
    if _lower_detail(scene, mesh.node):
        notes.append(f"mesh '{mesh.name}' is a lower level of detail: left out")
        return None
    number = {int(node): j for j, node in enumerate(skeleton.nodes)}
    influences = None if mesh.skin is None else _influences(mesh, mesh.skin, scene.path, notes)
    rigid = -1
    if mesh.skin is None or influences is None:
        node = mesh.node
        while node >= 0 and node not in number:
            node = int(scene.parents[node])
        if node < 0:
            notes.append(f"mesh '{mesh.name}' has no skin and hangs on no joint: left out")
            return None
        notes.append(f"mesh '{mesh.name}' has no skin: it follows joint '{scene.names[node]}' rigidly")
        rigid = number[node]
        try:
            hung = np.linalg.solve(scene.shown[node], mesh.shown)
        except np.linalg.LinAlgError:
            raise InputError(f"node '{scene.names[node]}' is shown without any size", path=scene.path) from None
        transforms = skeleton.binds[[rigid]] @ hung
        cluster, weights = np.zeros((len(mesh.points), 1), dtype=np.int64), np.ones((len(mesh.points), 1))
        joints = np.array([rigid])
    else:
        cluster, weights = influences
        joints = np.array([number[int(node)] for node in mesh.skin.nodes])
        transforms = skeleton.binds[joints] @ mesh.skin.inverses
        used = transforms[np.unique(cluster[weights > 0.0])]
        size = np.linalg.norm(np.ptp(mesh.points, axis=0))
        apart = np.abs(used - used[0])
        if max(apart[:, :3, 3].max(), size * apart[:, :3, :3].max()) > _BIND_TOLERANCE * size * np.abs(used[0]).max():
            notes.append(f"mesh '{mesh.name}' was bound in another pose than the other meshes: brought to theirs")
    blended = np.einsum("vk,vkij->vij", weights, transforms[cluster])
    vertices = np.einsum("vij,vj->vi", blended[:, :3, :3], mesh.points) + blended[:, :3, 3]
    triangles, polygons = triangulate_polygons(mesh.points[mesh.corners], mesh.counts)
    if np.linalg.det(transforms[0, :3, :3]) < 0.0:  # a mirrored mesh turns its triangles inside out
        triangles = triangles[:, ::-1]
    corner_uv = None if mesh.uv is None else mesh.uv[triangles]
    faces = mesh.corners[triangles]
    return RigMesh(
        mesh.name,
        vertices,
        faces,
        joints[cluster],
        weights,
        rigid,
        corner_uv=corner_uv,
        polygons=polygons,
        polygon_count=len(mesh.counts),
        texture=None if corner_uv is None or not mesh.texture else _texture(scene.path, mesh, notes),
    )


def _texture(path: Path, mesh: FbxMesh, notes: list[str]) -> bytes | None:
    """Encoded image of a mesh's texture: where the file names it, or of the same name beside the file.

    Paths of another machine are common, and embedded images are not read.
    """
    name = mesh.texture.replace("\\", "/")
    for place in (name, PurePosixPath(name).name):
        try:
            return read_bytes(path.parent / inside_folder(place))
        except (InputError, OSError):
            continue
    notes.append(f"mesh '{mesh.name}': its texture '{mesh.texture}' is not beside the file: not drawn")
    return None


def _lower_detail(scene: FbxScene, node: int) -> bool:
    """Whether a node is below a child, other than the first, of a level-of-detail group."""
    while (parent := int(scene.parents[node])) >= 0:
        if scene.kinds[parent] == "lod" and node != int(np.flatnonzero(scene.parents == parent)[0]):
            return True
        node = parent
    return False


def _influences(
    mesh: FbxMesh, skin: FbxSkin, path: Path, notes: list[str]
) -> tuple[NDArray[np.int64], NDArray[np.float64]] | None:
    """Clusters and weights of every vertex, shapes (W, K), rows summing to one; None if no vertex has any."""
    count = len(mesh.points)
    if not np.isfinite(skin.weight).all() or (skin.weight < 0.0).any():
        bad = int(skin.vertex[np.argwhere(~(np.isfinite(skin.weight) & (skin.weight >= 0.0)))[0][0]])
        raise InputError(f"mesh '{mesh.name}': vertex {bad} has a negative or non-finite weight", path=path)
    good = (skin.vertex >= 0) & (skin.vertex < count) & (skin.weight > 0.0)
    if (skin.vertex >= count).any():
        notes.append(f"mesh '{mesh.name}': weights of vertices beyond its {count} are left out")
    order = np.flatnonzero(good)[np.argsort(skin.vertex[good], kind="stable")]
    vertex = skin.vertex[order]
    if not len(vertex):
        return None
    numbers = np.bincount(vertex, minlength=count)
    slot = np.arange(len(vertex)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    cluster, weights = np.zeros((count, numbers.max()), dtype=np.int64), np.zeros((count, numbers.max()))
    cluster[vertex, slot], weights[vertex, slot] = skin.cluster[order], skin.weight[order]
    bare = numbers == 0
    if bare.any():
        notes.append(f"mesh '{mesh.name}': {int(bare.sum())} vertices have no weight: they follow the nearest that has")
        nearest = np.flatnonzero(~bare)[cKDTree(mesh.points[~bare]).query(mesh.points[bare])[1]]
        cluster[bare], weights[bare] = cluster[nearest], weights[nearest]
    total = weights.sum(axis=1)
    off = int((np.abs(total - 1.0) > 0.01).sum())
    if off:
        notes.append(f"mesh '{mesh.name}': weights of {off} vertices did not sum to one, normalised")
    return cluster, weights / total[:, None]
