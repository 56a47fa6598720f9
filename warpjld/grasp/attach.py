"""Rigid attachment of objects to joints over an interval of frames (A §7, R69–R72, C14)."""

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
        actor: Name of the actor whose joint it is.
        joint: Index of any joint of its skeleton (C14).
        start: Frame at which the object begins to move with the joint.
        stop: Frame from which on it stays where the joint has carried it.
    """

    actor: str
    joint: int
    start: float
    stop: float


def joint_basis(skeleton: Skeleton, poses: Poses, joint: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Basis of a joint: its position as origin; x the flexion axis, y along the segment, z = x × y (A §7, R70).

    y is the segment's direction made perpendicular to x.

    Returns:
        Origins [m], shape (F, 3), and rotations whose columns are x, y, z, shape (F, 3, 3).
    """
    x, y = skeleton.axes[joint], skeleton.directions[joint]
    y = y - x * (x @ y)
    if np.linalg.norm(y) < 1e-6:  # axis and segment are parallel: take any perpendicular direction
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
    """Placements of an object at F frames: its initial one, carried by joints, then where these left it (R71, R72).

    With B(t) the joint's basis, the object moves by B(t) B(start)⁻¹, which is the identity at the start and keeps its
    last value after the stop, so that the motion is continuous.

    Args:
        place: The initial placement (one).
        associations: Intervals in which the object follows a joint; they may not overlap. In any order.
        frames: Frame numbers, fractions allowed, shape (F,).
        basis: Function that gives origins and axes of an association's joint at frames, see :func:`joint_basis`.

    Raises:
        InputError: Two associations overlap, or one stops before it starts.
    """
    ordered = sorted(associations, key=lambda a: (a.start, a.stop))
    for earlier, later in pairwise(ordered):
        if later.start < earlier.stop:
            raise InputError(
                f"an object cannot follow two joints at once: from {earlier.start:g} to {earlier.stop:g} and "
                f"from {later.start:g} to {later.stop:g}"
            )
    at = np.asarray(frames, dtype=np.float64)
    position = np.repeat(place.position[:1], len(at), axis=0)
    turn = np.repeat(Rotation.from_quat(place.rotation[0]).as_matrix()[None], len(at), axis=0)
    here, facing = place.position[0], Rotation.from_quat(place.rotation[0]).as_matrix()
    for association in ordered:
        start, stop = association.start, association.stop
        if stop < start:
            raise InputError(f"an association cannot stop ({stop:g}) before it starts ({start:g})")
        after = at > start
        moments = np.concatenate([[start, stop], np.minimum(at[after], stop)])
        origin, axes = basis(association, moments)
        change = axes @ axes[0].T
        place_then = origin + np.einsum("fij,j->fi", change, here - origin[0])
        turn_then = change @ facing
        position[after], turn[after] = place_then[2:], turn_then[2:]
        here, facing = place_then[1], turn_then[1]
    return Places(position, Rotation.from_matrix(turn).as_quat())
