"""Animations of glTF files, sampled at frames."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import slerp, unit
from warpjld.geometry.scales import TINY, never_zero
from warpjld.limits import check_limit
from warpjld.motion.animations import choose_animation
from warpjld.motion.frame_times import frame_rate, frame_times, merged_times
from warpjld.motion.joint_animation import JointAnimation, streamed_animation
from warpjld.runtime.lazily import lazy_module
from warpjld.skeleton.streamed_poses import BLOCK

if TYPE_CHECKING:
    from warpjld.io.gltf.document import Document

if TYPE_CHECKING:
    import scipy.spatial.transform as transform
else:
    transform = lazy_module("scipy.spatial.transform")

__all__ = ["gltf_animation_names", "read_gltf_animation"]

_PATHS = {"translation": 3, "rotation": 4, "scale": 3}  # components of a value
_OTHER_PATHS = {"weights": "morph targets", "pointer": "properties that are no joint's"}
_SINGLE = float(np.finfo(np.float32).eps)


def gltf_animation_names(path: str | Path) -> tuple[str, ...]:
    """Names of a glTF file's animations, without repetition.

    Raises:
        InputError: Not a glTF file.
    """
    from warpjld.io.gltf.animation_list import list_animations
    from warpjld.io.gltf.document import open_document

    document = open_document(path)
    with document.reading():
        return tuple(list_animations(document))


def read_gltf_animation(path: str | Path, *, rate: float | None = None, name: str | None = None) -> JointAnimation:
    """An animation of a glTF file.

    Args:
        path: A .gltf or .glb file with an animation.
        rate: Frames a second; None for the spacing of the file's keys, see ``frame_rate``.
        name: Name of the animation, in any case; None for the first.

    Raises:
        InputError: Not a glTF file, no animation, none of that name, or invalid samplers.
    """
    from warpjld.io.gltf.animation_list import list_animations
    from warpjld.io.gltf.document import open_document
    from warpjld.io.gltf.skin import joint_nodes, joint_tree

    document = open_document(path)
    with document.reading():
        animations = list_animations(document)
        if not animations:
            raise InputError("no animation in this file", path=document.path)
        if not document.gltf.skins:  # every node may be a joint
            check_limit("joints", len(document.gltf.nodes), path=document.path)
        title, notes = choose_animation(name, tuple(animations), document.path)
        keys, warnings = _read_channels(document, [document.gltf.animations[n] for n in animations[title]])
        if len(animations[title]) > 1:
            notes = (*notes, f"{len(animations[title])} animations, each of one node, play together")
        at, rate = _frames(document, keys, rate)
        warnings += _check(document, keys, at)
        nodes = joint_nodes(document) if document.gltf.skins else list(range(len(document.gltf.nodes)))
        tree = joint_tree(document, nodes)

        def some(frames: slice) -> JointAnimation:
            worlds = _worlds(document, keys, at[frames])[0][:, nodes]
            return JointAnimation(tree, worlds, rate, title=title, notes=notes, warnings=tuple(warnings))

        return streamed_animation(len(at), some)


def _frames(document: Document, keys: list[_Keys], rate: float | None) -> tuple[NDArray[np.float64], float]:
    """Times of the frames [s], and frame rate [1/s]."""
    if not keys:
        raise InputError("its animation moves no joint", path=document.path)
    distinct = {id(key.times): key.times for key in keys}  # usually one: most nodes share their key times
    times = merged_times(np.concatenate(list(distinct.values())))
    rate = frame_rate(times) if rate is None else rate
    at = frame_times(times[0], times[-1], rate)
    check_limit("transforms", len(at) * len(document.gltf.nodes), path=document.path)
    return at, rate


def _check(document: Document, keys: list[_Keys], at: NDArray[np.float64]) -> list[str]:
    """Warnings about mirroring scale; InputError if a transform is not finite."""
    mirrored: dict[int, str] = {}
    for start in range(0, len(at), BLOCK):
        worlds, found = _worlds(document, keys, at[start : start + BLOCK])
        if not np.isfinite(worlds).all():
            frame, node = np.argwhere(~np.isfinite(worlds))[0][:2]
            raise InputError(f"node '{document.name(node)}' is not finite at frame {start + frame}", path=document.path)
        for node, frame in found.items():
            mirrored.setdefault(
                node,
                f"node '{document.name(node)}': its scale turns negative at frame {start + frame}: "
                "joints are placed as the file says, but no flesh is mirrored",
            )
    return [mirrored[node] for node in sorted(mirrored)]


class _Keys:
    """Keys of one animated property of a node."""

    def __init__(
        self, document: Document, sampler: Any, node: int, path: str, known: dict[int, NDArray[np.float64]]
    ) -> None:
        self.node, self.path = node, path
        if sampler.input not in known:
            known[sampler.input] = document.accessor(sampler.input).astype(np.float64).ravel()
        self.times = known[sampler.input]
        self.mode = sampler.interpolation or "LINEAR"
        values = document.accessor(sampler.output)  # usually float32; converted to float64 only where used
        per_key = 3 if self.mode == "CUBICSPLINE" else 1
        where = f"animation of '{document.name(node)}', {path}"
        if self.mode not in ("LINEAR", "STEP", "CUBICSPLINE"):
            raise InputError(f"{where}: unknown interpolation '{self.mode}'", path=document.path)
        if len(self.times) == 0 or values.shape != (per_key * len(self.times), _PATHS[path]):
            want = (per_key * len(self.times), _PATHS[path])
            raise InputError(f"{where}: want {want} values, got {values.shape}", path=document.path)
        if not (np.isfinite(self.times).all() and np.isfinite(values).all() and (np.diff(self.times) >= 0).all()):
            raise InputError(f"{where}: key times must increase, and all be finite", path=document.path)
        if path == "rotation" and not (values[per_key // 2 :: per_key] != 0.0).any(axis=1).all():
            raise InputError(f"{where}: a key is no rotation: its quaternion is zero", path=document.path)
        # of keys at one time after rounding to float32 the last is kept
        last = np.append(np.diff(self.times) > 0.0, True)
        self.values = values.reshape(len(self.times), per_key, _PATHS[path])
        self.rounding = 2.0 * _SINGLE * float(np.abs(self.times).max())
        if not last.all():
            self.values, self.times = self.values[last], self.times[last]

    def __call__(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at increasing times, shape (F, 3) or (F, 4); constant outside the keys."""
        at = np.clip(at, self.times[0], self.times[-1])
        # the keys around these times, and one more at both ends: a frame on a key may lie before it by rounding
        first = max(int(np.searchsorted(self.times, at[0], side="right")) - 2, 0)
        last = int(np.searchsorted(self.times, at[-1] + self.rounding, side="right")) + 1
        return self._near(at, self.times[first:last], self.values[first:last].astype(np.float64))

    def _near(
        self, at: NDArray[np.float64], times: NDArray[np.float64], keys: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        values = keys[:, keys.shape[1] // 2]
        rotation = self.path == "rotation"
        if rotation and self.mode != "CUBICSPLINE":
            values = unit(values)
        if len(times) == 1:
            out = np.repeat(values, len(at), axis=0)
        elif self.mode == "STEP":
            # key times are rounded to float32: a frame on a key must not be taken as before it
            out = values[np.maximum(np.searchsorted(times - self.rounding, at, side="right") - 1, 0)]
        elif self.mode == "CUBICSPLINE":
            out = _cubic(at, times, keys)
        elif rotation:
            return slerp(times, values, at)
        else:
            out = np.stack([np.interp(at, times, column) for column in values.T], axis=-1)
        return unit(out) if rotation else np.asarray(out)


def _cubic(at: NDArray[np.float64], times: NDArray[np.float64], keys: NDArray[np.float64]) -> NDArray[np.float64]:
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    length = (times[k + 1] - times[k])[:, None]
    u = (at - times[k])[:, None] / length
    start, leaving = keys[k, 1], keys[k, 2]
    arriving, end = keys[k + 1, 0], keys[k + 1, 1]
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * start
        + (u**3 - 2 * u**2 + u) * length * leaving
        + (3 * u**2 - 2 * u**3) * end
        + (u**3 - u**2) * length * arriving
    )


def _read_channels(document: Document, animations: list[Any]) -> tuple[list[_Keys], list[str]]:
    """Keys of all nodes, and warnings about animated properties that are ignored."""
    keys: dict[tuple[int, str], _Keys] = {}
    times: dict[int, NDArray[np.float64]] = {}
    left_out: dict[str, None] = {}
    for animation in animations:
        for channel in animation.channels:
            node, path = channel.target.node, channel.target.path
            if node is None or path not in _PATHS:
                left_out[_OTHER_PATHS.get(path, path)] = None
                continue
            if not (0 <= node < len(document.gltf.nodes) and 0 <= channel.sampler < len(animation.samplers)):
                raise InputError(f"its animation names node {node} or sampler {channel.sampler}", path=document.path)
            keys[node, path] = _Keys(document, animation.samplers[channel.sampler], node, path, times)
    return list(keys.values()), [f"the animation of {what} is not followed" for what in left_out]


def _worlds(
    document: Document, keys: list[_Keys], at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], dict[int, int]]:
    """World transforms of all nodes, shape (F, N, 4, 4), as ``JointAnimation.worlds`` has them, and the first frame in
    which each node's scale has another sign than at rest.

    Positions are those of the file. Where a scale becomes negative that was not so at rest, axes are computed with
    its sign at rest, since a mirrored frame is no rotation.
    """
    count = len(document.gltf.nodes)
    by_node: dict[int, dict[str, _Keys]] = {}
    for key in keys:
        by_node.setdefault(key.node, {})[key.path] = key
    local = np.empty((len(at), count, 4, 4))
    held: dict[int, NDArray[np.float64]] = {}
    mirrored: dict[int, int] = {}
    for node in range(count):
        local[:, node] = document.local(node)
        if node in by_node:
            local[:, node], turned = _animated(document, node, by_node[node], at)
            if turned is not None:
                held[node], mirrored[node] = turned
    order = _parents_first(document)
    with np.errstate(invalid="ignore", over="ignore"):  # values that are not finite are rejected later
        worlds = _compose(document, order, local)
        if held:
            for node, linear in held.items():
                local[:, node, :3, :3] = linear
            worlds[..., :3, :3] = _compose(document, order, local)[..., :3, :3]
    return worlds, mirrored


def _compose(document: Document, order: list[int], local: NDArray[np.float64]) -> NDArray[np.float64]:
    worlds = local.copy()
    for node in order:
        above = int(document.parents[node])
        if above >= 0:
            worlds[:, node] = worlds[:, above] @ local[:, node]
    return worlds


def _parents_first(document: Document) -> list[int]:
    order = np.flatnonzero(document.parents < 0).tolist()
    for node in order:
        order.extend(document.gltf.nodes[node].children or ())
    return order


def _animated(
    document: Document, node: int, keys: dict[str, _Keys], at: NDArray[np.float64]
) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], int] | None]:
    """Transforms of a node relative to its parent, shape (F, 4, 4); if its scale changes sign, also the linear parts
    without the change of sign, shape (F, 3, 3), and the first such frame."""
    fixed = dict(zip(_PATHS, document.parts(node), strict=True))
    values = {p: keys[p](at) if p in keys else np.tile(fixed[p], (len(at), 1)) for p in _PATHS}
    turn = transform.Rotation.from_quat(values["rotation"]).as_matrix()
    out = np.zeros((len(at), 4, 4))
    out[:, :3, :3] = turn * never_zero(values["scale"])[:, None, :]
    out[:, :3, 3] = values["translation"]
    out[:, 3, 3] = 1.0
    signs = np.where(fixed["scale"] < 0.0, -1.0, 1.0)
    changed = (values["scale"] * signs < -TINY).any(axis=1)
    if not changed.any():
        return out, None
    magnitude = signs * np.abs(never_zero(values["scale"]))
    return out, (turn * magnitude[:, None, :], int(np.argmax(changed)))
