"""Skinned and animated GLB files written from arrays, with the liberties that exporters take, and an animal to put
into them."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pygltflib as gl
import pyvista as pv
from scipy.spatial.transform import Rotation

Track = tuple[np.ndarray, np.ndarray, str]
"""Key times, values as glTF lays them out, and the interpolation."""

UNIT = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass
class Skinned:
    """A skinned animal, or whatever has bones; all arrays in metres, Y up."""

    names: list[str]
    parents: list[int]
    offsets: np.ndarray  # of joints from their parents, in the parents' frames, shape (J, 3)
    turns: np.ndarray  # rest rotations relative to the parents, quaternions, shape (J, 4)
    vertices: np.ndarray
    faces: np.ndarray
    joints: np.ndarray  # (V, 4)
    weights: np.ndarray  # (V, 4)
    scales: dict[int, tuple[float, float, float]] = field(default_factory=dict)

    def frames(self) -> np.ndarray:
        """Joint-to-world transforms at rest, scale left out, shape (J, 4, 4)."""
        out = np.tile(np.eye(4), (len(self.names), 1, 1))
        for j, parent in enumerate(self.parents):
            out[j, :3, :3] = Rotation.from_quat(self.turns[j]).as_matrix()
            out[j, :3, 3] = self.offsets[j]
            if parent >= 0:
                out[j] = out[parent] @ out[j]
        return out


# joint → parent, place [m], radius of its flesh towards its children
_ANIMAL = {
    "trunk": (None, (0.0, 0.5, -0.4), 0.09),
    "girth": ("trunk", (0.0, 0.5, 0.0), 0.09),
    "nape": ("girth", (0.0, 0.52, 0.4), 0.06),
    "skull": ("nape", (0.0, 0.75, 0.55), 0.07),
    "flap.a": ("skull", (0.06, 0.84, 0.53), 0.02),
    "flap.b": ("skull", (-0.06, 0.84, 0.53), 0.02),
    "brush1": ("trunk", (0.0, 0.52, -0.52), 0.035),
    "brush2": ("brush1", (0.0, 0.56, -0.8), 0.03),
    "prop.a1": ("girth", (0.08, 0.45, 0.2), 0.035),
    "prop.a2": ("prop.a1", (0.1, 0.2, 0.2), 0.03),
    "prop.b1": ("trunk", (-0.08, 0.45, -0.35), 0.035),
    "prop.b2": ("prop.b1", (-0.1, 0.2, -0.35), 0.03),
}
_ENDS = {
    "flap.a": (0.1, 1.05, 0.5),
    "flap.b": (-0.1, 1.05, 0.5),
    "brush2": (0.0, 0.62, -1.1),
    "prop.a2": (0.1, 0.0, 0.2),
    "prop.b2": (-0.1, 0.0, -0.35),
}
"""Where flesh ends beyond the last joints."""
_SNOUT = (0.0, 0.72, 0.95)


@cache
def animal(snout: bool = False) -> Skinned:
    """Trunk, neck, head with ears, tail and two legs, whose names say nothing; bones along local y.

    A vertex follows the bone it is nearest to, blended only near joints, so that most have one bone. A snout is flesh
    of the head that no joint below it reaches.
    """
    names = list(_ANIMAL)
    parents = [-1 if p is None else names.index(p) for p, _, _ in _ANIMAL.values()]
    places = np.array([place for _, place, _ in _ANIMAL.values()])
    rods = _bones() + ([("skull", _SNOUT, 0.06)] if snout else [])
    bones = [(names.index(p), np.array(q), places[names.index(p)], r) for p, q, r in rods]
    vertices, faces = _flesh(bones)
    joints, weights = _paint(vertices, bones)
    turns = np.empty((len(names), 4))
    world: list[Rotation] = []
    for j, name in enumerate(names):
        aim = next((np.array(q) for p, q, _ in _bones() if p == name), places[j] + [0, 1, 0]) - places[j]
        frame = Rotation.align_vectors([aim], [[0, 1, 0]])[0] * Rotation.from_rotvec([0, 0.7 * j, 0])
        turns[j] = (frame if parents[j] < 0 else world[parents[j]].inv() * frame).as_quat()
        world.append(frame)
    offsets = [places[j] if p < 0 else world[p].inv().apply(places[j] - places[p]) for j, p in enumerate(parents)]
    return Skinned(names, parents, np.array(offsets), turns, vertices, faces, joints, weights)


def _bones() -> list[tuple[str, tuple[float, float, float], float]]:
    """Joint, other end and radius of every bone."""
    out = [(parent, place, _ANIMAL[parent][2]) for parent, place, _ in _ANIMAL.values() if parent is not None]
    return out + [(name, end, _ANIMAL[name][2]) for name, end in _ENDS.items()]


def _distances(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    t = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    return np.linalg.norm(points - start - t[:, None] * along, axis=1)


def _flesh(bones: list[tuple[int, np.ndarray, np.ndarray, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Marching cubes of capsules about the bones."""
    step = 0.022
    ends = np.array([[start, end] for _, end, start, _ in bones]).reshape(-1, 3)
    low, high = ends.min(axis=0) - 0.15, ends.max(axis=0) + 0.15
    grid = pv.ImageData(dimensions=np.ceil((high - low) / step).astype(int) + 1, spacing=(step,) * 3, origin=low)
    points = np.asarray(grid.points)
    field_ = np.min([_distances(points, start, end) - r for _, end, start, r in bones], axis=0)
    mesh = grid.contour([0.0], field_).triangulate().clean()
    faces = mesh.faces.reshape(-1, 4)[:, 1:]
    return np.asarray(mesh.points, dtype=np.float64), np.asarray(faces[:, ::-1] if _inside_out(mesh) else faces)


def _inside_out(mesh: pv.PolyData) -> bool:
    corners = np.asarray(mesh.points, dtype=np.float64)[mesh.faces.reshape(-1, 4)[:, 1:]]
    return bool(np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() < 0)


def _paint(points: np.ndarray, bones: list[tuple[int, np.ndarray, np.ndarray, float]]) -> tuple[np.ndarray, np.ndarray]:
    far = np.array([_distances(points, start, end) - r for _, end, start, r in bones])
    count = 1 + max(joint for joint, *_ in bones)
    best = np.full((count, len(points)), np.inf)
    for row, (joint, *_) in zip(far, bones, strict=True):
        best[joint] = np.minimum(best[joint], row)
    share = np.maximum(0.01 - (best - best.min(axis=0)), 0.0).T
    joints = np.argsort(-share, axis=1, kind="stable")[:, :4]
    weights = np.take_along_axis(share, joints, axis=1)
    return joints, weights / weights.sum(axis=1, keepdims=True)


class Writer:
    """A GLB file under construction."""

    def __init__(self) -> None:
        self.gltf = gl.GLTF2(scene=0, scenes=[gl.Scene(nodes=[])], asset=gl.Asset(version="2.0"), buffers=[gl.Buffer()])
        self.blob = b""

    def accessor(self, array: np.ndarray, kind: str, dtype: str = "<f4") -> int:
        types = {"<f4": gl.FLOAT, "<u2": gl.UNSIGNED_SHORT, "<u4": gl.UNSIGNED_INT}
        data = np.ascontiguousarray(array, dtype=dtype).tobytes()
        self.blob += b"\0" * (-len(self.blob) % 4)
        self.gltf.bufferViews.append(gl.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data)))
        self.blob += data
        view = len(self.gltf.bufferViews) - 1
        self.gltf.accessors.append(
            gl.Accessor(bufferView=view, componentType=types[dtype], count=len(array), type=kind)
        )
        return len(self.gltf.accessors) - 1

    def node(self, name: str | None, **fields: object) -> int:
        self.gltf.nodes.append(gl.Node(name=name, **fields))
        return len(self.gltf.nodes) - 1

    def animate(self, name: str | None, tracks: dict[tuple[int, str], Track]) -> None:
        """An animation, its tracks by node and path."""
        animation = gl.Animation(name=name)
        for (node, path), (times, values, mode) in tracks.items():
            kind = "VEC4" if path == "rotation" else "VEC3"
            sampler = gl.AnimationSampler(
                input=self.accessor(times, "SCALAR"), output=self.accessor(values, kind), interpolation=mode
            )
            animation.samplers.append(sampler)
            target = gl.AnimationChannelTarget(node=node, path=path)
            animation.channels.append(gl.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))
        self.gltf.animations.append(animation)

    def save(self, path: Path) -> Path:
        self.gltf.buffers[0].byteLength = len(self.blob)
        self.gltf.set_binary_blob(self.blob)
        self.gltf.save_binary(str(path))
        return path


def write(
    path: Path,
    what: Skinned,
    animations: dict[str, dict[tuple[int, str], Track]],
    *,
    unit: float = 1.0,
    armature: dict[str, list[float]] | None = None,
    matrices: bool = False,
    shown: dict[int, np.ndarray] | None = None,
    skinned: bool = True,
    above: int = 1,
) -> Path:
    """Write a file; its joints are nodes in the order of ``what``, so that tracks name them by number.

    Args:
        path: Where to.
        what: The content.
        animations: Tracks by joint and path of every animation, translations in metres.
        unit: The file's units in a metre.
        armature: Transform of the node above all joints.
        matrices: Whether nodes that are not animated hold matrices.
        shown: Rotations (quaternions) of joints relative to their parents in which the file shows them, where they are
            not those it was bound in.
        skinned: Whether there is a mesh at all; without one the file holds nodes only.
        above: Nodes between the scene and the joints.
    """
    out = Writer()
    animated = {joint for tracks in animations.values() for joint, _ in tracks}
    for j, name in enumerate(what.names):
        children = [k for k, parent in enumerate(what.parents) if parent == j]
        turn = (shown or {}).get(j, what.turns[j])
        place = {"translation": (unit * what.offsets[j]).tolist(), "rotation": [float(x) for x in turn]}
        if j in what.scales:
            place["scale"] = list(what.scales[j])
        if matrices and j not in animated:
            local = np.eye(4)
            local[:3, :3] = Rotation.from_quat(turn).as_matrix() * np.array(what.scales.get(j, (1.0, 1.0, 1.0)))
            local[:3, 3] = unit * what.offsets[j]
            place = {"matrix": local.T.ravel().tolist()}
        out.node(name, children=children, **place)
    top = [j for j, parent in enumerate(what.parents) if parent < 0]
    bind = what.frames()
    bind[:, :3, 3] *= unit
    vertices = unit * what.vertices
    for n in range(above):
        fields = (armature or {}) if n == above - 1 else {}
        top = [out.node("Armature" if n == above - 1 else f"group{n}", children=top, **fields)]
    if skinned:
        attributes = gl.Attributes(
            POSITION=out.accessor(vertices, "VEC3"),
            JOINTS_0=out.accessor(what.joints, "VEC4", "<u2"),
            WEIGHTS_0=out.accessor(what.weights, "VEC4"),
        )
        indices = out.accessor(what.faces.ravel(), "SCALAR", "<u4")
        out.gltf.meshes.append(gl.Mesh(name="hide", primitives=[gl.Primitive(attributes=attributes, indices=indices)]))
        inverse = np.linalg.inv(bind).swapaxes(1, 2).reshape(-1, 16)
        out.gltf.skins.append(
            gl.Skin(joints=list(range(len(what.names))), inverseBindMatrices=out.accessor(inverse, "MAT4"))
        )
        top.append(out.node("Mesh", mesh=0, skin=0))
    out.gltf.scenes[0].nodes = top
    for name, tracks in animations.items():
        metres = {
            key: (times, unit * np.asarray(values) if key[1] == "translation" else values, mode)
            for key, (times, values, mode) in tracks.items()
        }
        out.animate(name, metres)
    return out.save(path)
