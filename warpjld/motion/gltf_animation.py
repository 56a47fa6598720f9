"""Animations of glTF files, sampled at frames."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.motion.frame_times import frame_times
from warpjld.motion.joint_animation import JointAnimation
from warpjld.rotations import slerp, unit

if TYPE_CHECKING:
    from warpjld.io.gltf.document import Document

__all__ = ["read_gltf_animation"]

_PATHS = {"translation": 3, "rotation": 4, "scale": 3}
_DEFAULT_RATE = 30.0


def read_gltf_animation(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """An animation of a glTF file.

    Args:
        path: A .gltf or .glb file with an animation.
        rate: Frames a second; None for the spacing of the file's keys, or 30 where they are uneven.
        name: Which animation; None for the first.

    Raises:
        InputError: No glTF, no animation, or broken samplers.
    """
    from warpjld.io.gltf.document import open_document
    from warpjld.io.gltf.skin import joint_nodes, joint_tree

    document = open_document(path)
    try:
        worlds, rate = _sample(document, rate)
        nodes = joint_nodes(document) if document.gltf.skins else list(range(worlds.shape[1]))
        return JointAnimation(joint_tree(document, nodes), worlds[:, nodes], rate)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        # pygltflib takes any JSON: what the schema forbids shows where it is used
        raise InputError(f"not as glTF 2.0 wants it: {error}", path=path) from error


def _sample(document: Document, rate: float | None) -> tuple[NDArray[np.float64], float]:
    """World transforms of all nodes, shape (F, N, 4, 4), over the first animation, and its frames a second."""
    if not document.gltf.animations:
        raise InputError("no animation in this file", path=document.path)
    keys = _read_channels(document, document.gltf.animations[0])
    if not keys:
        raise InputError("its animation moves no joint", path=document.path)
    times = np.unique(np.concatenate([key.times for key in keys]))
    rate = _spacing(times) if rate is None else rate
    with np.errstate(invalid="ignore", over="ignore"):
        worlds = _worlds(document, keys, frame_times(times[0], times[-1], rate))
    if not np.isfinite(worlds).all():
        frame, node = np.argwhere(~np.isfinite(worlds))[0][:2]
        raise InputError(f"node '{document.name(node)}' is not finite at frame {frame}", path=document.path)
    return worlds, rate


class _Keys:
    """Keys of one property of one node."""

    def __init__(self, document: Document, sampler: Any, node: int, path: str) -> None:
        self.node, self.path = node, path
        self.times = document.accessor(sampler.input).astype(np.float64).ravel()
        self.mode = sampler.interpolation or "LINEAR"
        values = document.accessor(sampler.output).astype(np.float64)
        per_key = 3 if self.mode == "CUBICSPLINE" else 1
        where = f"animation of '{document.name(node)}', {path}"
        if self.mode not in ("LINEAR", "STEP", "CUBICSPLINE"):
            raise InputError(f"{where}: unknown interpolation '{self.mode}'", path=document.path)
        if len(self.times) == 0 or values.shape != (per_key * len(self.times), _PATHS[path]):
            want = (per_key * len(self.times), _PATHS[path])
            raise InputError(f"{where}: want {want} values, got {values.shape}", path=document.path)
        if not (np.isfinite(self.times).all() and np.isfinite(values).all() and (np.diff(self.times) > 0).all()):
            raise InputError(f"{where}: key times must increase, and all be finite", path=document.path)
        if path == "rotation" and not (np.linalg.norm(values[per_key // 2 :: per_key], axis=1) > 0.0).all():
            raise InputError(f"{where}: a key is no rotation: its quaternion is zero", path=document.path)
        self.values = values.reshape(len(self.times), per_key, _PATHS[path])

    def __call__(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at times, shape (F, 3) or (F, 4); held outside the keys."""
        values = self.values[:, self.values.shape[1] // 2]
        rotation = self.path == "rotation"
        if rotation and self.mode != "CUBICSPLINE":
            values = unit(values)
        at = np.clip(at, self.times[0], self.times[-1])
        if len(self.times) == 1:
            out = np.repeat(values, len(at), axis=0)
        elif self.mode == "STEP":
            out = values[np.searchsorted(self.times, at, side="right") - 1]
        elif self.mode == "CUBICSPLINE":
            out = self._cubic(at)
        elif rotation:
            return slerp(self.times, values, at)
        else:
            out = np.stack([np.interp(at, self.times, column) for column in values.T], axis=-1)
        return unit(out) if rotation else np.asarray(out)

    def _cubic(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        k = np.clip(np.searchsorted(self.times, at, side="right") - 1, 0, len(self.times) - 2)
        length = (self.times[k + 1] - self.times[k])[:, None]
        u = (at - self.times[k])[:, None] / length
        start, leaving = self.values[k, 1], self.values[k, 2]
        arriving, end = self.values[k + 1, 0], self.values[k + 1, 1]
        return np.asarray(
            (2 * u**3 - 3 * u**2 + 1) * start
            + (u**3 - 2 * u**2 + u) * length * leaving
            + (3 * u**2 - 2 * u**3) * end
            + (u**3 - u**2) * length * arriving
        )


def _read_channels(document: Document, animation: Any) -> list[_Keys]:
    keys = []
    for channel in animation.channels:
        node, path = channel.target.node, channel.target.path
        if node is None or path not in _PATHS:  # morph weights, or a target an extension names
            continue
        if not (0 <= node < len(document.gltf.nodes) and 0 <= channel.sampler < len(animation.samplers)):
            raise InputError(f"its animation names node {node} or sampler {channel.sampler}", path=document.path)
        keys.append(_Keys(document, animation.samplers[channel.sampler], node, path))
    return keys


def _spacing(times: NDArray[np.float64]) -> float:
    steps = np.diff(times)
    if len(steps) == 0:
        return _DEFAULT_RATE
    step = float(np.median(steps))
    even = np.abs(steps - step).max() < 0.02 * step
    return round(1.0 / step, 3) if even and 1.0 <= 1.0 / step <= 1000.0 else _DEFAULT_RATE


def _worlds(document: Document, keys: list[_Keys], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """World transforms of all nodes, shape (F, N, 4, 4)."""
    count = len(document.gltf.nodes)
    local = np.empty((len(at), count, 4, 4))
    by_node: dict[int, dict[str, _Keys]] = {}
    for key in keys:
        by_node.setdefault(key.node, {})[key.path] = key
    for node in range(count):
        local[:, node] = document.local(node)
        if node in by_node:
            local[:, node] = _animated(document, node, by_node[node], at)
    worlds = np.empty_like(local)
    done: set[int] = set()
    for node in range(count):
        chain = [node]
        while (above := int(document.parents[chain[-1]])) >= 0 and above not in done:
            chain.append(above)
        for link in reversed([n for n in chain if n not in done]):
            above = int(document.parents[link])
            worlds[:, link] = local[:, link] if above < 0 else worlds[:, above] @ local[:, link]
            done.add(link)
    return worlds


def _animated(document: Document, node: int, keys: dict[str, _Keys], at: NDArray[np.float64]) -> NDArray[np.float64]:
    record = document.gltf.nodes[node]
    if record.matrix is not None:
        raise InputError(f"node '{document.name(node)}' is animated, yet has a matrix", path=document.path)
    fixed = {
        "translation": record.translation or (0.0, 0.0, 0.0),
        "rotation": record.rotation or (0.0, 0.0, 0.0, 1.0),
        "scale": record.scale or (1.0, 1.0, 1.0),
    }
    values = {p: keys[p](at) if p in keys else np.tile(fixed[p], (len(at), 1)).astype(np.float64) for p in _PATHS}
    out = np.zeros((len(at), 4, 4))
    out[:, :3, :3] = Rotation.from_quat(values["rotation"]).as_matrix() * values["scale"][:, None, :]
    out[:, :3, 3] = values["translation"]
    out[:, 3, 3] = 1.0
    return out
