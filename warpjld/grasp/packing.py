"""Conversion of coverings, poses and chains of joints to the structures of the search kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering import Covering
from warpjld.covering.device import array_on
from warpjld.covering.drivers import flexion_ratio, virtual_lengths
from warpjld.covering.rows import Padded
from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, multiply
from warpjld.grasp.struct_arrays import StructArrays
from warpjld.skeleton import Poses, Skeleton
from warpjld.skeleton.channels import ABDUCTION, FLEXION, PIVOT, TWISTING

__all__ = [
    "Chains",
    "drives_arrays",
    "drives_on",
    "fill_drives",
    "fill_posture",
    "posture_arrays",
    "posture_on",
    "skin_on",
]


@dataclass(frozen=True, eq=False)
class Chains:
    """R chains of joints that close together, each in one frame.

    The closing c is a chain's only parameter: joint k has the flexion start + rate · c, up to its stop.

    Attributes:
        frame: Frame of every chain, shape (R,).
        joints: Joints from the root outwards, -1 where there are fewer than four, shape (R, 4).
        rates: Flexion of every joint per unit of closing [rad], negative where it extends, shape (R, 4).
        stops: Flexion at which each stops [rad], shape (R, 4).
        starts: Flexion at which each begins [rad], shape (R, 4).
    """

    frame: NDArray[np.int32]
    joints: NDArray[np.int32]
    rates: NDArray[np.float64]
    stops: NDArray[np.float64]
    starts: NDArray[np.float64]

    def __getitem__(self, rows: NDArray[np.int64]) -> Chains:
        return Chains(self.frame[rows], self.joints[rows], self.rates[rows], self.stops[rows], self.starts[rows])

    @property
    def reach(self) -> NDArray[np.float64]:
        """Closing at which the last joint reaches its stop, shape (R,)."""
        moving = (self.joints >= 0) & (self.rates != 0.0)
        span = (self.stops - self.starts) / np.where(moving, self.rates, 1.0)
        return np.asarray(np.where(moving, span, 0.0).max(axis=1, initial=0.0))

    def angles(self, closing: NDArray[np.float64]) -> NDArray[np.float64]:
        """Flexion of every joint at a closing of its chain (R,) [rad], shape (R, 4)."""
        low, high = np.minimum(self.starts, self.stops), np.maximum(self.starts, self.stops)
        return np.asarray(np.clip(self.starts + self.rates * closing[:, None], low, high))


def skin_on(device: Any, coverings: Sequence[Covering]) -> Any:
    """``warpjld_kernels.closing_chain.Skin``: operators of coverings of one skeleton and surface, concatenated.

    Vertex v of covering c is row c · V + v.

    Raises:
        InputError: Coverings of different surfaces, or of another method than the smooth one.
    """
    import warp as wp
    from warpjld_kernels.closing_chain import Skin

    first = coverings[0]
    for covering in coverings:
        if covering.skeleton is not first.skeleton or len(covering.anchors) != len(first.anchors):
            raise InputError("coverings: want parameter sets of one surface on one skeleton (with_parameters)")
        if type(covering) is not Covering:
            raise InputError("coverings: searches know the smooth method only; bind with method='smooth'")
    anchors, joints = first.anchors, len(first.skeleton)
    rows = [covering.rows for covering in coverings]
    muscles = sp.vstack([r.muscles for r in rows], format="csr")
    heights = np.concatenate([r.heights for r in rows])
    skin = Skin()
    for name, padded, kind in (
        ("position", Padded.of(sp.vstack([r.positions for r in rows], format="csr")), float),
        ("turn", Padded.of(sp.vstack([r.turns for r in rows], format="csr")), float),
        ("rounding", Padded.of(sp.vstack([r.scales[:, :joints] for r in rows], format="csr")), float),
        ("palm", Padded.of(sp.vstack([r.scales[:, joints:] for r in rows], format="csr")), float),
        ("muscle", Padded.of(muscles, muscles.data[:, None] * heights), wp.vec3),
    ):
        setattr(skin, f"{name}_input", array_on(device, padded.column, wp.int32))
        setattr(skin, name, array_on(device, padded.value, kind))
    skin.offset = array_on(device, np.concatenate([r.offset for r in rows]), wp.vec3)
    skin.ends = array_on(device, anchors.ends, wp.int32)
    skin.parents = array_on(device, first.skeleton.parents, wp.int32)
    pairs = anchors.pairs if len(anchors.pairs) else np.zeros((1, 2), np.int32)
    skin.pairs = array_on(device, pairs, wp.int32)
    skin.across = array_on(device, virtual_lengths(anchors.ends, pairs, first.skeleton.rest[None])[0], float)
    proximal = anchors.ends[pairs, 0]
    skin.exponent = array_on(device, np.stack([c.parameters.palm[proximal].mean(axis=1) for c in coverings]), float)
    skin.vertices = len(anchors)
    return skin


def posture_on(device: Any, skeleton: Skeleton, poses: Poses, origin: NDArray[np.float64]) -> Any:
    """``warpjld_kernels.closing_chain.Posture``, positions relative to an origin for every frame [m], shape (F, 3)."""
    return fill_posture(posture_arrays(device), skeleton, poses, origin)


def posture_arrays(device: Any) -> StructArrays:
    """A ``Posture`` without arrays, for ``fill_posture``."""
    from warpjld_kernels.closing_chain import Posture

    return StructArrays(Posture(), device)


def fill_posture(out: StructArrays, skeleton: Skeleton, poses: Poses, origin: NDArray[np.float64]) -> Any:
    """``posture_on`` in arrays that are kept."""
    import warp as wp

    out.fill("positions", poses.positions - origin[:, None], wp.vec3)
    out.fill("rotations", poses.rotations, wp.quat)
    out.fill("flexion_ratio", flexion_ratio(skeleton, poses.flexion), float)
    return out.struct


def drives_on(device: Any, skeleton: Skeleton, poses: Poses, angles: NDArray[np.float64], chains: Chains) -> Any:
    """``warpjld_kernels.closing_chain.Drives``: axes, rates and limits of the joints that move, for every chain.

    Args:
        device: Warp device.
        skeleton: Of J joints.
        poses: F poses that the chains start from.
        angles: Joint angles of these poses [rad], shape (F, J, 4).
        chains: The joints that move.

    Raises:
        InputError: Joints of a chain that do not lie one beyond the other.
    """
    return fill_drives(drives_arrays(device), skeleton, poses, angles, chains)


def drives_arrays(device: Any) -> StructArrays:
    """``Drives`` without arrays, for ``fill_drives``."""
    from warpjld_kernels.closing_chain import Drives

    return StructArrays(Drives(), device)


def fill_drives(
    out: StructArrays, skeleton: Skeleton, poses: Poses, angles: NDArray[np.float64], chains: Chains
) -> Any:
    """``drives_on`` in arrays that are kept."""
    import warp as wp

    frame, joints = chains.frame, chains.joints
    used = joints >= 0
    j = np.where(used, joints, 0)
    channels = angles[frame[:, None], j]
    mirror = skeleton.mirror[j]
    direction, axis = skeleton.directions[j], skeleton.axes[j]
    before = _about(skeleton.normals[j], mirror * channels[..., ABDUCTION])
    if skeleton.initial_turns is not None:  # turns count from rest
        before = multiply(conjugate(skeleton.initial_turns[j]), before)
    bend = _turn(_about(direction, mirror * channels[..., PIVOT]), axis)
    after = _about(direction, -mirror * channels[..., TWISTING])
    first = Rotation.from_quat(_flat(before))
    local = first * Rotation.from_quat(_flat(_about(bend, channels[..., FLEXION])))
    local = local * Rotation.from_quat(_flat(after))
    carried = Rotation.from_quat(_flat(poses.rotations[frame[:, None], j])) * local.inv()
    world = (carried * first).apply(bend.reshape(-1, 3)).reshape(bend.shape)
    upright, level, slope = (constants[j] for constants in _bending(skeleton))
    for name, values, kind in (
        ("frame", frame, wp.int32),
        ("reach", chains.reach, float),
        ("count", used.sum(axis=1), wp.int32),
        ("joint", joints, wp.int32),
        ("rate", chains.rates, float),
        ("start", chains.starts, float),
        ("stop", chains.stops, float),
        ("axis", world, wp.vec3),
        ("before", before, wp.quat),
        ("bend", bend, wp.vec3),
        ("after", after, wp.quat),
        ("direction", direction, wp.vec3),
        ("upright", upright, wp.vec3),
        ("level", level, wp.vec3),
        ("largest", slope, float),
        ("depth", _depths(skeleton, joints), wp.int32),
    ):
        out.fill(name, values, kind)
    return out.struct


@lru_cache(maxsize=8)  # skeletons are compared by identity
def _bending(skeleton: Skeleton) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Of every joint: where flexion is measured from and to, (J, 3), and 1 over its largest, 0 for none, (J,)."""
    straight, level = skeleton.straight
    upright = straight - level * (straight * level).sum(axis=-1, keepdims=True)
    length = np.linalg.norm(upright, axis=-1, keepdims=True)
    upright = np.where(length > 1e-6, upright / np.maximum(length, 1e-12), 0.0)
    largest = skeleton.limits[:, FLEXION, 1]
    moves = (largest > 1e-6) & (skeleton.parents >= 0)
    return upright, np.cross(level, upright), np.where(moves, 1.0 / np.where(moves, largest, 1.0), 0.0)


def _depths(skeleton: Skeleton, joints: NDArray[np.int32]) -> NDArray[np.int32]:
    """Number of a chain's joints among each joint of the skeleton and its ancestors, shape (R, J)."""
    # rows as numbers: sorting these is quicker than sorting rows
    code = (joints.astype(np.int64) + 1) @ (len(skeleton) + 1) ** np.arange(joints.shape[1])
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    return np.array([_depths_of(skeleton, tuple(joints[k].tolist())) for k in first], dtype=np.int32)[place]


@lru_cache(maxsize=1024)
def _depths_of(skeleton: Skeleton, chain: tuple[int, ...]) -> tuple[int, ...]:
    """Depths of one chain, for every joint.

    Raises:
        InputError: Joints of the chain that do not lie one beyond the other.
    """
    movers, depths = [j for j in chain if j >= 0], [0] * len(skeleton)
    for j, parent in enumerate(skeleton.parents.tolist()):
        depths[j] = (depths[parent] if parent >= 0 else 0) + (j in movers)
    if [depths[m] for m in movers] != list(range(1, len(movers) + 1)):
        names = ", ".join(skeleton.names[m] for m in movers)
        raise InputError(f"joints that close together must lie one beyond the other, got {names}")
    return tuple(depths)


def _about(axis: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quaternions x, y, z, w of rotations about unit axes (…, 3) by angles (…) [rad]."""
    half = 0.5 * np.broadcast_to(angle, axis.shape[:-1])[..., None]
    return np.concatenate([np.sin(half) * axis, np.cos(half)], axis=-1)


def _turn(q: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (…, 3) rotated by quaternions (…, 4)."""
    return Rotation.from_quat(_flat(q)).apply(v.reshape(-1, 3)).reshape(v.shape)


def _flat(q: NDArray[np.float64]) -> NDArray[np.float64]:
    return q.reshape(-1, 4)
