"""Animations of glTF files, sampled at frames: of a rig's own skin as they are, of another by retargeting."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.motion.clip import Clip
from warpjld.motion.frame_times import frame_times
from warpjld.motion.retarget import retarget
from warpjld.rig import Rig
from warpjld.rotations import slerp, unit
from warpjld.skeleton import Poses, poses_from_world

if TYPE_CHECKING:
    from warpjld.io.gltf.document import Document

__all__ = ["poses_of_gltf"]

_PATHS = {"translation": 3, "rotation": 4, "scale": 3}
_SAME = 1e-4
"""Rest transforms that differ by less, relative to the skeleton's size, are those of one skeleton."""
_DEFAULT_RATE = 30.0


def poses_of_gltf(path: str | Path, rig: Rig, *, rate: float | None = None) -> tuple[Poses, float]:
    """Poses of the first animation of a glTF file.

    Where the file's joints are the rig's own, names and rest, each joint takes its world transform relative to rest,
    so that flat hierarchies and moving joints are followed; scale moves joints, but does not widen the flesh, and
    joints that recognition merged into another (twist bones, say) only count by where they carry the joints below
    them. Another skeleton's animation drives the rig by ``retarget``.

    Args:
        path: A .gltf or .glb file with an animation.
        rig: What is driven.
        rate: Frames a second; None for the spacing of the file's keys, or 30 where they are uneven.

    Raises:
        InputError: No glTF, no animation, broken samplers, or no joint in common.
    """
    from warpjld.io.gltf.document import open_document

    document = open_document(path)
    try:
        worlds, rate = _sample(document, rate)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        # pygltflib takes any JSON: what the schema forbids shows where it is used
        raise InputError(f"not as glTF 2.0 wants it: {error}", path=path) from error
    moved = _own_joints(document, rig, worlds)
    if moved is None:
        return retarget(_clip(document, worlds, rate), rig.skeleton), rate
    skeleton = rig.skeleton
    rotations = Rotation.from_matrix(moved[..., :3, :3].reshape(-1, 3, 3)).as_quat().reshape(*moved.shape[:2], 4)
    positions = np.einsum("fjab,jb->fja", moved[..., :3, :3], skeleton.rest) + moved[..., :3, 3]
    return poses_from_world(skeleton, positions, rotations), rate


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


def _own_joints(document: Document, rig: Rig, worlds: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Each joint's motion from the rig's rest, shape (F, J, 4, 4); None where the file has another skeleton.

    The rig may have been turned and scaled on loading: the same motion then turns and scales what the file animates.
    """
    if rig.source_frames is None or not any(rig.source_joints):
        return None
    joints_last = [*range(len(document.gltf.nodes)), *(n for skin in document.gltf.skins or () for n in skin.joints)]
    nodes = {document.name(n): n for n in joints_last}  # of nodes with one name the last counts: a skin's joint
    own = [(j, nodes[name]) for j, name in enumerate(rig.source_joints) if name and name in nodes]
    if len(own) < sum(bool(name) for name in rig.source_joints):
        return None
    joints, where = (np.array(column) for column in zip(*own, strict=True))
    frames, rest = rig.source_frames[joints], document.worlds[where]
    placing = frames[0] @ np.linalg.inv(rest[0])
    size = float(np.linalg.norm(np.ptp(rig.skeleton.rest, axis=0))) or 1.0
    off = placing @ rest - frames
    if np.abs(off[:, :3, 3]).max() > _SAME * size or np.abs(off[:, :3, :3]).max() > _SAME * np.abs(frames).max():
        return None
    moved = np.empty((len(worlds), len(rig.skeleton), 4, 4))
    moved[:, joints] = placing @ worlds[:, where] @ np.linalg.inv(frames)
    for j, parent in enumerate(rig.skeleton.parents):
        if j not in joints:  # an added fingertip, say
            moved[:, j] = moved[:, parent] if parent >= 0 else np.eye(4)
    return moved


def _clip(document: Document, worlds: NDArray[np.float64], rate: float) -> Clip:
    """The joints of the file's skins, or all its nodes, as another skeleton's motion."""
    nodes = sorted({n for skin in document.gltf.skins or () for n in skin.joints}) or list(range(worlds.shape[1]))
    depth = {}
    for node in nodes:
        depth[node], above = 0, int(document.parents[node])
        while above >= 0:
            depth[node], above = depth[node] + 1, int(document.parents[above])
    nodes.sort(key=lambda n: (depth[n], n))
    number = {node: b for b, node in enumerate(nodes)}
    parents = np.full(len(nodes), -1)
    for b, node in enumerate(nodes):
        above = int(document.parents[node])
        while above >= 0 and above not in number:
            above = int(document.parents[above])
        parents[b] = number.get(above, -1)
    rest = document.worlds[nodes]
    joints = worlds[:, nodes]
    turned = joints[..., :3, :3] @ np.linalg.inv(rest[:, :3, :3])
    rotations = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_quat().reshape(len(worlds), len(nodes), 4)
    names = tuple(document.name(n) for n in nodes)
    return Clip(names, parents, rest[:, :3, 3], joints[..., :3, 3], rotations, rate)
