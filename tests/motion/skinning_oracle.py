"""Plain skinning of a GLB file's vertices, by the letter of the glTF 2.0 specification: what its own animation is.

Float64, one frame at a time, nothing of the project in it.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Record(dict[str, Any]):
    """A JSON object whose members are attributes; None where it has none of that name."""

    def __getattr__(self, name: str) -> Any:
        return self.get(name)


class Skinning:
    """One file and one of its animations.

    Attributes:
        joints: Skin joints of every vertex, shape (V, 4).
        weights: Their weights, shape (V, 4).
        first: Time of its first key [s].
    """

    def __init__(self, path: Path, animation: int = 0, node: int | None = None) -> None:
        content = path.read_bytes()
        (length,) = struct.unpack_from("<I", content, 12)  # of the first chunk, JSON; the other's head is 8 bytes more
        self.gltf = json.loads(content[20 : 20 + length], object_hook=Record)
        self.blob = content[28 + length :]
        animations = [self.gltf.animations[animation]] if self.gltf.animations else []
        self.tracks = {}
        for one in animations:
            for channel in one.channels:
                sampler = one.samplers[channel.sampler]
                self.tracks[channel.target.node, channel.target.path] = (
                    self.read(sampler.input)[:, 0],
                    self.read(sampler.output),
                    sampler.interpolation or "LINEAR",
                )
        self.first = min((times[0] for times, _, _ in self.tracks.values()), default=0.0)
        holders = [n for n, record in enumerate(self.gltf.nodes) if record.skin is not None]
        self.holder = self.gltf.nodes[holders[0] if node is None else node]
        primitives = self.gltf.meshes[self.holder.mesh].primitives
        self.points, joints, self.weights = (
            np.concatenate([self.read(getattr(p.attributes, name)) for p in primitives])
            for name in ("POSITION", "JOINTS_0", "WEIGHTS_0")
        )
        self.joints = joints.astype(int)

    def read(self, index: int) -> np.ndarray:
        """An accessor's numbers, shape (n, width)."""
        accessor = self.gltf.accessors[index]
        view = self.gltf.bufferViews[accessor.bufferView]
        width = _WIDTHS[accessor.type]
        start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
        data = np.frombuffer(self.blob, _TYPES[accessor.componentType], accessor.count * width, start)
        return data.astype(float).reshape(-1, width)

    def worlds(self, time: float | None) -> np.ndarray:
        """Node-to-world transforms, shape (N, 4, 4); of the pose the file shows for no time."""
        nodes = self.gltf.nodes
        above = {child: n for n, node in enumerate(nodes) for child in node.children or ()}
        locals_ = [self._local(n, time) for n in range(len(nodes))]
        out = []
        for n in range(len(nodes)):
            world, at = locals_[n], n
            while at in above:
                at = above[at]
                world = locals_[at] @ world
            out.append(world)
        return np.array(out)

    def _local(self, n: int, time: float | None) -> np.ndarray:
        node = self.gltf.nodes[n]
        if node.matrix is not None:
            return np.array(node.matrix).reshape(4, 4).T
        values = {
            "translation": node.translation or [0, 0, 0],
            "rotation": node.rotation or [0, 0, 0, 1],
            "scale": node.scale or [1, 1, 1],
        }
        for path in values:
            if time is not None and (n, path) in self.tracks:
                values[path] = _sample(*self.tracks[n, path], path, time)
        out = np.eye(4)
        out[:3, :3] = Rotation.from_quat(values["rotation"]).as_matrix() @ np.diag(values["scale"])
        out[:3, 3] = values["translation"]
        return out

    def vertices(self, time: float | None) -> np.ndarray:
        """World positions of the skin, shape (V, 3)."""
        skin = self.gltf.skins[self.holder.skin]
        inverse = self.read(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
        moves = self.worlds(time)[skin.joints] @ inverse
        homogeneous = np.column_stack([self.points, np.ones(len(self.points))])
        return np.einsum("vk,vkij,vj->vi", self.weights, moves[self.joints], homogeneous)[:, :3]


def _sample(times: np.ndarray, values: np.ndarray, mode: str, path: str, time: float) -> np.ndarray:
    time = float(np.clip(time, times[0], times[-1]))
    k = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, max(len(times) - 2, 0)))
    if mode == "CUBICSPLINE":
        length = times[k + 1] - times[k]
        u = (time - times[k]) / length
        v0, b0, a1, v1 = values[3 * k + 1], values[3 * k + 2], values[3 * k + 3], values[3 * k + 4]
        h = (2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2)
        value = h[0] * v0 + length * h[1] * b0 + h[2] * v1 + length * h[3] * a1
        return value / np.linalg.norm(value) if path == "rotation" else value
    if mode == "STEP" or len(times) == 1:
        return values[np.flatnonzero(times <= time + 1e-5)[-1]]
    u = (time - times[k]) / (times[k + 1] - times[k])
    if path != "rotation":
        return (1 - u) * values[k] + u * values[k + 1]
    a, b = values[k], values[k + 1]
    b = -b if a @ b < 0 else b
    angle = np.arccos(np.clip(a @ b, -1, 1))
    if angle < 1e-6:
        return a + u * (b - a)
    return (np.sin((1 - u) * angle) * a + np.sin(u * angle) * b) / np.sin(angle)
