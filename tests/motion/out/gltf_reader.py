"""A GLB evaluated from its JSON and bytes, apart from what the package does: an oracle for its writer."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def chunks(path: Path) -> tuple[dict[str, Any], bytes]:
    """JSON and binary content."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    assert size % 4 == 0
    content = json.loads(data[20 : 20 + size])
    binary, kind = struct.unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0"
    assert content["buffers"] == [{"byteLength": binary}]
    return content, data[28 + size :]


def array(content: dict[str, Any], binary: bytes, number: int) -> NDArray[Any]:
    accessor = content["accessors"][number]
    view = content["bufferViews"][accessor["bufferView"]]
    assert view["buffer"] == 0
    dtype = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    assert start % np.dtype(dtype).itemsize == 0
    return np.frombuffer(binary, dtype, width * accessor["count"], start).reshape(accessor["count"], width)


def turn(quaternion: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def evaluate(path: Path, animation: int = 0) -> tuple[dict[str, Any], NDArray[np.float64], NDArray[np.float64]]:
    """JSON, key times (F,), and node-to-world transforms at the keys (F, nodes, 4, 4)."""
    content, binary = chunks(path)
    nodes = content["nodes"]
    moved: dict[int, dict[str, NDArray[Any]]] = {}
    times = np.zeros(0)
    for channel in content["animations"][animation]["channels"]:
        sampler = content["animations"][animation]["samplers"][channel["sampler"]]
        assert sampler.get("interpolation", "LINEAR") == "LINEAR"
        times = array(content, binary, sampler["input"])[:, 0].astype(np.float64)
        record = content["accessors"][sampler["input"]]
        assert (record["min"], record["max"]) == ([times.min()], [times.max()])
        values = array(content, binary, sampler["output"]).astype(np.float64)
        moved.setdefault(channel["target"]["node"], {})[channel["target"]["path"]] = values
    parents = {child: n for n, node in enumerate(nodes) for child in node.get("children", ())}
    worlds = np.zeros((len(times), len(nodes), 4, 4))

    def world(frame: int, n: int) -> NDArray[np.float64]:
        node, keys = nodes[n], moved.get(n, {})
        if "matrix" in node:
            assert not keys, "an animated node must not have a matrix"
            local = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        else:
            local = np.eye(4)
            local[:3, 3] = keys["translation"][frame] if "translation" in keys else node.get("translation", (0, 0, 0))
            quaternion = keys["rotation"][frame] if "rotation" in keys else node.get("rotation", (0, 0, 0, 1))
            local[:3, :3] = turn(np.array(quaternion, dtype=np.float64)) * np.array(node.get("scale", (1, 1, 1)))
        return world(frame, parents[n]) @ local if n in parents else local

    for frame in range(len(times)):
        for n in range(len(nodes)):
            worlds[frame, n] = world(frame, n)
    return content, times, worlds


def skinned(path: Path, content: dict[str, Any], worlds: NDArray[np.float64], node: int) -> NDArray[np.float64]:
    """Vertices of a skinned node's first primitive under node transforms (nodes, 4, 4), shape (W, 3)."""
    binary = chunks(path)[1]
    skin = content["skins"][content["nodes"][node]["skin"]]
    attributes = content["meshes"][content["nodes"][node]["mesh"]]["primitives"][0]["attributes"]
    points = array(content, binary, attributes["POSITION"]).astype(np.float64)
    binds = array(content, binary, skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2).astype(np.float64)
    palette = worlds[skin["joints"]] @ binds
    out = np.zeros_like(points)
    total = np.zeros(len(points))
    n = 0
    while f"JOINTS_{n}" in attributes:
        joints = array(content, binary, attributes[f"JOINTS_{n}"])
        weights = array(content, binary, attributes[f"WEIGHTS_{n}"]).astype(np.float64)
        for k in range(4):
            m = palette[joints[:, k]]
            out += weights[:, k, None] * (np.einsum("vab,vb->va", m[:, :3, :3], points) + m[:, :3, 3])
        total += weights.sum(axis=1)
        n += 1
    np.testing.assert_allclose(total, 1.0, atol=1e-5)
    return out
