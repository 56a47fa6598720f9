"""A new glTF document of a rig: its surface, a skin, and its joints in metres with Y up."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld import __version__
from warpjld.geometry.normals import vertex_normals
from warpjld.motion.out.baked_skin import BakedSkin
from warpjld.motion.out.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from warpjld.motion.out.local_motion import nearest_rotations
from warpjld.motion.out.node_tree import NodeTree
from warpjld.motion.out.skin_weights import joint_weights
from warpjld.motion.out.source_motion import SourceMotion
from warpjld.rig import Rig

__all__ = ["new_document"]


def new_document(
    rig: Rig,
    motion: SourceMotion,
    notes: list[str],
    baked: BakedSkin | None = None,
) -> tuple[GlbFile, NodeTree]:
    """A document of the rig at rest, and its nodes; the mesh's node follows those of the joints.

    Args:
        rig: The rig.
        motion: Motion of its joints.
        notes: Notes for users of the file are appended.
        baked: Skin weights that replace the rig's own, with morph targets.
    """
    rest_worlds = motion.rest_frames.copy()
    # joints keep the file's axes but not its scale, which has no effect here
    rest_worlds[:, :3, :3] = nearest_rotations(rest_worlds[:, :3, :3])
    parents = motion.tree.parents
    rest = rest_worlds.copy()
    hang = parents >= 0
    rest[hang] = np.linalg.inv(rest_worlds[parents[hang]]) @ rest_worlds[hang]
    count = len(parents)
    file = GlbFile({"asset": {"version": "2.0", "generator": f"warpjld {__version__}"}}, [])
    nodes = [_node(motion.tree.names[j], rest[j], motion.tree.children[j]) for j in range(count)]
    nodes.append({"name": rig.name, "mesh": 0, "skin": 0})
    binds = np.linalg.inv(rest_worlds).swapaxes(1, 2).reshape(count, 16).astype("<f4")  # glTF stores columns
    binds[:, 3:12:4], binds[:, 15] = 0.0, 1.0
    file.content |= {
        "scene": 0,
        "scenes": [{"nodes": [*np.flatnonzero(~hang).tolist(), count]}],
        "nodes": nodes,
        "meshes": [_mesh(file, rig, motion, baked, notes)],
        "skins": [{"joints": list(range(count)), "inverseBindMatrices": file.add(binds, "MAT4")}],
        # the default material of glTF is metallic
        "materials": [
            {
                "name": "skin",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [0.78, 0.50, 0.38, 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.6,
                },
            }
        ],
    }

    def worlds(frames: slice) -> NDArray[np.float64]:
        return np.asarray(motion.moves(frames) @ rest_worlds)

    every = np.arange(count)
    return file, NodeTree(nodes, every, parents, rest, rest_worlds, np.ones((count, 3)), every, worlds)


def _node(name: str, rest: NDArray[np.float64], children: tuple[int, ...]) -> dict[str, Any]:
    node: dict[str, Any] = {
        "name": name,
        "translation": rest[:3, 3].tolist(),
        "rotation": Rotation.from_matrix(rest[:3, :3]).as_quat().tolist(),
    }
    if children:
        node["children"] = list(children)
    return node


def _mesh(file: GlbFile, rig: Rig, motion: SourceMotion, baked: BakedSkin | None, notes: list[str]) -> dict[str, Any]:
    """The surface in its source's vertex order, followed by copies for texture seams, with all influences."""
    surface = rig.surface
    origin, faces, uv = surface.split_at_seams()
    vertex = surface.weld[origin]
    copies = len(origin) - len(surface.weld)
    if copies:
        notes.append(f"after the source's {len(surface.weld)} vertices {copies} copies, one more for each seam")
    rest = surface.vertices.astype("<f4")[vertex]
    normals = vertex_normals(surface.vertices, surface.faces).astype("<f4")[vertex]
    attributes = {
        "POSITION": file.add(rest, "VEC3", target=ARRAY_BUFFER, bounds=True),
        "NORMAL": file.add(normals, "VEC3", target=ARRAY_BUFFER),
    }
    if uv is not None:
        # v runs downwards from the top of the image in glTF
        flipped = np.asarray(uv, np.float32) * [1, -1] + [0, 1]
        attributes["TEXCOORD_0"] = file.add(flipped.astype("<f4"), "VEC2", target=ARRAY_BUFFER)
    influences = joint_weights(rig, motion, notes) if baked is None else (baked.joints, baked.weights)
    joints, weights = (array[vertex] for array in influences)
    for first in range(0, joints.shape[1], 4):
        part = slice(first, first + 4)
        n = first // 4
        attributes[f"JOINTS_{n}"] = file.add(joints[:, part].astype("<u2"), "VEC4", target=ARRAY_BUFFER)
        attributes[f"WEIGHTS_{n}"] = file.add(weights[:, part].astype("<f4"), "VEC4", target=ARRAY_BUFFER)
    corners = faces.astype("<u4").reshape(-1)
    primitive = {
        "attributes": attributes,
        "indices": file.add(corners, "SCALAR", target=ELEMENT_ARRAY_BUFFER),
        "material": 0,
    }
    mesh: dict[str, Any] = {"name": rig.name, "primitives": [primitive]}
    if baked is not None and baked.names:
        moved = baked.shapes.astype("<f4")[:, vertex]
        primitive["targets"] = [{"POSITION": file.add(m, "VEC3", target=ARRAY_BUFFER, bounds=True)} for m in moved]
        # not in the glTF standard, but where programs look for the targets' names
        mesh |= {"weights": baked.at_rest.tolist(), "extras": {"targetNames": list(baked.names)}}
    return mesh
