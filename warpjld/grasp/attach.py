"""Objects that follow a joint for a while (A §7, R69–R72, C14)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from warpjld.errors import InputError
from warpjld.grasp.objects import Places
from warpjld.skeleton import Poses, Skeleton

__all__ = ["Association", "carried", "joint_basis"]


@dataclass(frozen=True)
class Association:
    """An object follows a joint from ``start`` to ``stop`` [frames].

    Attributes:
        actor: Whose joint.
        joint: Any joint of its skeleton (C14).
        start: Until here the object is where it was before.
        stop: From here on it stays where it came to.
    """

    actor: str
    joint: int
    start: float
    stop: float


def joint_basis(skeleton: Skeleton, poses: Poses, joint: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origin and axes of a joint's basis: the joint; x its flexion axis, y its segment, z = x × y (A §7, R70).

    The segment is made perpendicular to the axis.

    Returns:
        Origins [m], shape (F, 3), and rotations whose columns are x, y, z, shape (F, 3, 3).
    """
    x, y = skeleton.axes[joint], skeleton.directions[joint]
    y = y - x * (x @ y)
    if np.linalg.norm(y) < 1e-6:  # the axis lies along the segment: any perpendicular direction will do
        y = np.cross(x, np.eye(3)[np.abs(x).argmin()])
    y = y / np.linalg.norm(y)
    rest = np.stack([x, y, np.cross(x, y)], axis=1)
    turn = Rotation.from_quat(poses.rotations[:, joint]).as_matrix()
    return poses.positions[:, joint], turn @ rest


def carried(
    place: Places,
    associations: Sequence[Association],
    frames: ArrayLike,
    basis: Callable[[Association, NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]],
) -> Places:
    """Where an object is at F frames: at its initial place, with a joint, at its final place (R71, R72).

    With B(t) the joint's basis, the object moves by B(t) B(start)⁻¹, which is the identity at the start and holds its
    last value after the stop: nothing jumps.

    Args:
        place: One placement, at first.
        associations: One after another, in any order.
        frames: Frame numbers, whole or not, shape (F,).
        basis: Origins and axes of an association's joint at frames, see :func:`joint_basis`.

    Raises:
        InputError: Two associations overlap, or one stops before it starts.
    """
    ordered = sorted(associations, key=lambda a: (a.start, a.stop))
    for one, other in pairwise(ordered):
        if other.start < one.stop:
            raise InputError(
                f"an object cannot follow two joints at once: from {one.start:g} to {one.stop:g} and "
                f"from {other.start:g} to {other.stop:g}"
            )
    at = np.asarray(frames, dtype=np.float64)
    position = np.repeat(place.position[:1], len(at), axis=0)
    turn = np.repeat(Rotation.from_quat(place.rotation[0]).as_matrix()[None], len(at), axis=0)
    here, facing = place.position[0], Rotation.from_quat(place.rotation[0]).as_matrix()
    for one in ordered:
        if one.stop < one.start:
            raise InputError(f"an association cannot stop ({one.stop:g}) before it starts ({one.start:g})")
        later = at > one.start
        moments = np.concatenate([[one.start, one.stop], np.minimum(at[later], one.stop)])
        origin, axes = basis(one, moments)
        change = axes @ axes[0].T
        place_then = origin + np.einsum("fij,j->fi", change, here - origin[0])
        turn_then = change @ facing
        position[later], turn[later] = place_then[2:], turn_then[2:]
        here, facing = place_then[1], turn_then[1]
    return Places(position, Rotation.from_matrix(turn).as_quat())
