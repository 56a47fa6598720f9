"""A writer of small skinned GLB files with every liberty the format allows, and a hand to put into them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pygltflib as gl
import pytest
from scipy.spatial.transform import Rotation

from warpjld.rig import Rig


@dataclass
class Glb:
    """Content of a file; what is left empty takes the plainest form."""

    names: list[str]
    parents: list[int]
    frames: np.ndarray  # (J, 4, 4) world
    vertices: np.ndarray
    faces: np.ndarray
    joints: np.ndarray  # (W, K)
    weights: np.ndarray
    uv: np.ndarray | None = None
    flat: bool = False
    matrices: bool = False
    armature: np.ndarray = field(default_factory=lambda: np.eye(4))
    mesh_node: np.ndarray = field(default_factory=lambda: np.eye(4))
    bind_frames: np.ndarray | None = None
    weight_type: type = np.float32
    interleaved: bool = False
    sparse: bool = False
    split: bool = False  # two meshes
    skinned: bool = True


_TYPES = {np.float32: gl.FLOAT, np.uint8: gl.UNSIGNED_BYTE, np.uint16: gl.UNSIGNED_SHORT, np.uint32: gl.UNSIGNED_INT}


class _Writer:
    def __init__(self, glb: Glb) -> None:
        self.glb = glb
        self.out = gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[])], asset=gl.Asset(version="2.0"))
        self.blob = b""

    def view(self, data: bytes, stride: int | None = None) -> int:
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.out.bufferViews.append(
            gl.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data), byteStride=stride)
        )
        self.blob += data
        return len(self.out.bufferViews) - 1

    def accessor(self, array: np.ndarray, kind: str, **more: object) -> int:
        array = np.ascontiguousarray(array)
        view = more.pop("view", None)
        view = self.view(array.tobytes()) if view is None else view
        self.out.accessors.append(
            gl.Accessor(bufferView=view, componentType=_TYPES[array.dtype.type], count=len(array), type=kind, **more)
        )
        return len(self.out.accessors) - 1

    def positions(self, points: np.ndarray) -> int:
        points = points.astype(np.float32)
        if self.glb.interleaved:
            rows = np.hstack([points, np.full_like(points, np.nan)])  # what a reader must step over
            return self.accessor(points, "VEC3", view=self.view(rows.tobytes(), stride=24))
        if self.glb.sparse:
            wrong = points.copy()
            wrong[[1, 4]] = 1e6
            index = self.accessor(wrong, "VEC3")
            self.out.accessors[index].sparse = gl.Sparse(
                count=2,
                indices=gl.AccessorSparseIndices(
                    bufferView=self.view(np.array([1, 4], np.uint16).tobytes()), componentType=gl.UNSIGNED_SHORT
                ),
                values=gl.AccessorSparseValues(bufferView=self.view(points[[1, 4]].tobytes())),
            )
            return index
        return self.accessor(points, "VEC3")

    def primitive(self, faces: np.ndarray) -> gl.Primitive:
        glb = self.glb
        used, corners = np.unique(faces, return_inverse=True)
        attributes = gl.Attributes(POSITION=self.positions(glb.vertices[used]))
        if glb.skinned:
            joints, weights = glb.joints[used], glb.weights[used]
            pad = -joints.shape[1] % 4
            joints, weights = (np.pad(a, ((0, 0), (0, pad))) for a in (joints, weights))
            if glb.weight_type is not np.float32:
                weights = np.round(weights * np.iinfo(glb.weight_type).max)
            for n in range(joints.shape[1] // 4):
                part = slice(4 * n, 4 * n + 4)
                setattr(attributes, f"JOINTS_{n}", self.accessor(joints[:, part].astype(np.uint16), "VEC4"))
                index = self.accessor(weights[:, part].astype(glb.weight_type), "VEC4")
                self.out.accessors[index].normalized = glb.weight_type is not np.float32
                setattr(attributes, f"WEIGHTS_{n}", index)
        if glb.uv is not None:
            attributes.TEXCOORD_0 = self.accessor(glb.uv[used].astype(np.float32), "VEC2")
        indices = self.accessor(corners.reshape(-1).astype(np.uint32), "SCALAR")
        return gl.Primitive(attributes=attributes, indices=indices)

    def write(self, path: Path) -> Path:
        glb, out = self.glb, self.out
        for j, name in enumerate(glb.names):
            above = -1 if glb.flat else glb.parents[j]
            local = (np.linalg.inv(glb.frames[above]) if above >= 0 else np.eye(4)) @ glb.frames[j]
            kids = [] if glb.flat else [int(k) for k in np.flatnonzero(np.array(glb.parents) == j)]
            out.nodes.append(_node(name, local, kids, glb.matrices))
        roots = [j for j in range(len(glb.names)) if glb.flat or glb.parents[j] < 0]
        halves = np.array_split(glb.faces, 2) if glb.split else [glb.faces]
        for n, faces in enumerate(halves):
            out.meshes.append(gl.Mesh(name=f"mesh{n}", primitives=[self.primitive(faces)]))
            node = _node(f"mesh node {n}", glb.mesh_node, [], False)
            node.mesh, node.skin = n, 0 if glb.skinned else None
            out.nodes.append(node)
            roots.append(len(out.nodes) - 1)
        out.nodes.append(_node("Armature", glb.armature, roots, False))
        out.scenes[0].nodes = [len(out.nodes) - 1]
        if glb.skinned:
            bind = np.linalg.inv(glb.armature @ (glb.frames if glb.bind_frames is None else glb.bind_frames))
            matrices = self.accessor(bind.swapaxes(1, 2).astype(np.float32), "MAT4")
            out.skins.append(gl.Skin(joints=list(range(len(glb.names))), inverseBindMatrices=matrices))
        out.buffers.append(gl.Buffer(byteLength=len(self.blob)))
        out.set_binary_blob(self.blob)
        out.save_binary(str(path))
        return path


def _node(name: str, local: np.ndarray, children: list[int], matrix: bool) -> gl.Node:
    if matrix:
        return gl.Node(name=name, matrix=[float(x) for x in local.T.ravel()], children=children)
    scale = np.linalg.norm(local[:3, :3], axis=0)
    turn = Rotation.from_matrix(local[:3, :3] / scale)
    return gl.Node(
        name=name,
        translation=[float(x) for x in local[:3, 3]],
        rotation=[float(x) for x in turn.as_quat()],
        scale=[float(x) for x in scale],
        children=children,
    )


@pytest.fixture(scope="session")
def write_glb() -> Callable[[Glb, Path], Path]:
    """Write a :class:`Glb`."""
    return lambda glb, path: _Writer(glb).write(path)


@pytest.fixture(scope="session")
def hand_glb(hands: dict[str, Rig]) -> Callable[..., Glb]:
    """A built-in hand as file content: bones on any local axis, rigid weights, names of one's choice."""

    def make(side: str = "left", axis: tuple[float, float, float] = (0, 1, 0), names: object = None) -> Glb:
        rig = hands[side]
        keep = [j for j, name in enumerate(rig.skeleton.names) if not name.endswith(".forearm")]
        skeleton = rig.skeleton
        parents = [keep.index(int(p)) if (p := skeleton.parents[j]) in keep else -1 for j in keep]
        frames = np.tile(np.eye(4), (len(keep), 1, 1))
        for i, j in enumerate(keep):
            # any frame whose chosen axis lies on the bone; its roll is arbitrary on purpose
            turn = Rotation.align_vectors([skeleton.directions[j]], [axis])[0] * Rotation.from_rotvec(
                0.7 * i * np.array(axis)
            )
            frames[i, :3, :3], frames[i, :3, 3] = turn.as_matrix(), skeleton.rest[j]
        vertices = rig.surface.vertices
        middle = [np.mean([skeleton.rest[j], *skeleton.rest[list(skeleton.children[j])]], axis=0) for j in keep]
        nearest = np.linalg.norm(vertices[:, None] - np.array(middle)[None], axis=2).argsort(axis=1)
        far = np.take_along_axis(np.linalg.norm(vertices[:, None] - np.array(middle)[None], axis=2), nearest, axis=1)
        weights = 1.0 / far[:, :6] ** 4
        rename = names or (lambda name: name)
        return Glb(
            names=[rename(skeleton.names[j]) for j in keep],  # type: ignore[operator]
            parents=parents,
            frames=frames,
            vertices=vertices,
            faces=rig.surface.faces,
            joints=nearest[:, :6],
            weights=weights / weights.sum(axis=1, keepdims=True),
        )

    return make
