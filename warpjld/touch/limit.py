"""Digits that close only until they touch: a bisection of how far each is bent, against the hand itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from warpjld.covering.intersections import crossing_faces
from warpjld.rotations import conjugate, multiply, rotate
from warpjld.skeleton.hand import DIGITS
from warpjld.skeleton.kinematics import Poses, vertical_flexion
from warpjld.touch.touch import Touch

if TYPE_CHECKING:
    from warpjld.covering.covering import Covering

__all__ = ["Closed", "close_until_touch"]

_STEPS = 8  # halvings: 1/256 of a digit's bend, a degree of a full fist
_ALLOWED = 0.5  # of the depth that can be parted
_BACK = 0.02  # of a bend, at first; twice as much each time


@dataclass(frozen=True)
class Closed:
    """A digit that was closed less than its pose says.

    Attributes:
        digit: E.g. ``left.index``.
        frame: Frame number.
        depth: How deep it would have been [m].
        share: Of its bend that is left, 0…1.
        flexion: Sum of its joints' flexion at which it touches [degrees].
    """

    digit: str
    frame: int
    depth: float
    share: float
    flexion: float


def close_until_touch(covering: Covering, poses: Poses, touch: Touch, *, first: int = 0) -> tuple[Poses, list[Closed]]:
    """Poses whose digits are bent only as far as they touch.

    The joints of a digit turn back together, by one share of their rotation from rest, which a bisection finds per
    frame: each digit's deepest overlap with anything else may be half of what TOUCH can part, and no face of it may
    cross another once it was parted. Digits are searched at once; those that stay free keep their pose exactly, and so
    does one that crosses something however far it opens (its ``share`` is 1).

    Args:
        covering: The hand or body.
        poses: F poses.
        touch: Its contact.
        first: Number of the first frame, for what is told.
    """
    digits = _digits(covering)
    if not digits:
        return poses, []
    names = list(digits)
    joints = [digits[name][0] for name in names]
    parts = [digits[name][1] for name in names]
    told: list[Closed] = []
    frames: list[Poses] = []
    for f in range(len(poses)):
        pose = poses[f : f + 1]
        meets, depth = _meets(covering, touch, pose, parts)
        meets &= np.array([_bend(covering, pose, some) > 1e-6 for some in joints])
        if meets.any():
            share = _search(covering, touch, pose, joints, parts, meets)
            pose = _bent(covering, pose, joints, share)
            for n in np.flatnonzero(meets).tolist():
                flexion = float(np.degrees(pose.flexion[0, joints[n]].sum()))
                told.append(Closed(names[n], first + f, float(depth[n]), float(share[n]), flexion))
        frames.append(pose)
    arrays = ([getattr(p, name) for p in frames] for name in ("positions", "rotations", "flexion"))
    return Poses(*(np.concatenate(a) for a in arrays)), told


def _search(
    covering: Covering,
    touch: Touch,
    pose: Poses,
    joints: list[list[int]],
    parts: list[NDArray[np.bool_]],
    bent: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Share of its bend that each digit keeps; 1 for those that do not touch, or touch however far they open."""

    def at(share: NDArray[np.float64]) -> NDArray[np.bool_]:
        return _meets(covering, touch, _bent(covering, pose, joints, share), parts)[0]

    bent = bent & ~at(np.where(bent, 0.0, 1.0))
    low, high = np.where(bent, 0.0, 1.0), np.ones(len(joints))
    for _ in range(_STEPS):
        share = np.where(bent, 0.5 * (low + high), 1.0)
        meets = at(share)
        low, high = np.where(bent & ~meets, share, low), np.where(bent & meets, share, high)
    # a digit was judged beside others on their way: what meets beside them at their ends opens a little more
    for step in range(_STEPS):
        meets = at(low) & bent
        if not meets.any():
            break
        low = np.where(meets, low - _BACK * 2.0**step, low).clip(0.0)
    return low


def _bend(covering: Covering, pose: Poses, joints: list[int]) -> float:
    """Largest rotation of a digit's joints from rest [rad]."""
    parents = [max(int(covering.skeleton.parents[j]), 0) for j in joints]
    local = multiply(conjugate(pose.rotations[:, parents]), pose.rotations[:, joints])
    return float(Rotation.from_quat(local.reshape(-1, 4)).magnitude().max())


def _digits(covering: Covering) -> dict[str, tuple[list[int], NDArray[np.bool_]]]:
    """Joints and parts of every digit; metacarpals are the palm's."""
    out: dict[str, tuple[list[int], NDArray[np.bool_]]] = {}
    names = covering.skeleton.names
    for j, name in enumerate(names):
        stem, _, last = name.rpartition(".")
        if stem.rpartition(".")[2] in DIGITS and last in ("base", "knuckle2", "knuckle3"):
            out.setdefault(stem, ([], np.array([fan.name.startswith(stem + ".") for fan in covering.fans])))[0].append(
                j
            )
    return {name: found for name, found in out.items() if found[1].any()}


def _meets(
    covering: Covering, touch: Touch, pose: Poses, parts: list[NDArray[np.bool_]]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Of every digit whether it overlaps more than can be parted well, or crosses anything after it was parted; and
    its deepest overlap with what is not itself [m]."""
    points = covering.deform(pose)
    found = touch.depths(points[0])
    part = touch.patches.part
    pairs = crossing_faces(touch.apply(points)[0][0], touch.patches.faces).pairs
    crossing = np.unique(part[touch.patches.faces[pairs]])
    hit = found.other >= 0
    meets, depth = np.zeros(len(parts), dtype=bool), np.zeros(len(parts))
    for n, inside in enumerate(parts):
        rows = hit & (inside[part] != inside[found.other])
        ratio = found.depth[rows] / np.maximum(touch.limit[rows], 1e-9)
        meets[n] = inside[crossing].any() or (ratio > _ALLOWED).any()
        depth[n] = float(found.depth[rows].max(initial=0.0))
    return meets, depth


def _bent(covering: Covering, pose: Poses, joints: list[list[int]], share: NDArray[np.float64]) -> Poses:
    """The pose with each digit's joints at a share of their rotation from rest; bones keep the pose's lengths."""
    skeleton = covering.skeleton
    part = np.ones(len(skeleton))
    for some, s in zip(joints, share, strict=True):
        part[some] = s
    changed = part < 1.0
    positions, rotations = pose.positions.copy(), pose.rotations.copy()
    local = pose.rotations.copy()
    for j, parent in enumerate(skeleton.parents.tolist()):
        if parent < 0:
            continue
        local[:, j] = multiply(conjugate(pose.rotations[:, parent]), pose.rotations[:, j])
        if part[j] < 1.0:
            local[:, j] = Rotation.from_rotvec(part[j] * Rotation.from_quat(local[:, j]).as_rotvec()).as_quat()
            local[:, j] *= np.where(local[:, j, 3:] < 0.0, -1.0, 1.0)
        if changed[j] or changed[parent]:
            changed[j] = True
            rotations[:, j] = multiply(rotations[:, parent], local[:, j])
            offset = rotate(conjugate(pose.rotations[:, parent]), pose.positions[:, j] - pose.positions[:, parent])
            positions[:, j] = positions[:, parent] + rotate(rotations[:, parent], offset)
    return Poses(positions, rotations, vertical_flexion(skeleton, local))
