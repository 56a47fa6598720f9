"""Pose inputs of the operators: joint positions, rotations, and the scalars that drive inflation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.covering.binding import STATIONS, Anchors
from warpjld.geometry.rotations import unit
from warpjld.skeleton.channels import FLEXION
from warpjld.skeleton.kinematics import Poses, vertical_flexion
from warpjld.skeleton.tree import Skeleton

__all__ = [
    "Drivers",
    "closing_logarithm",
    "drive",
    "flexion_ratio",
    "halfway_rotations",
    "initial_ratio",
    "virtual_lengths",
]


@dataclass(frozen=True, eq=False)
class Drivers:
    """Inputs of the operators over F frames.

    Attributes:
        positions: Joint positions [m], shape (F, J, 3).
        halfway: Rotation halfway between the two bones that meet at a joint, x y z w, shape (F, J, 4) (C22).
        rotations: Rotation of the bone that begins at a joint, x y z w, shape (F, J, 4).
        flexion_ratio: FR of every joint, 0 … 1, shape (F, J) (R59, C18).
        closing: log λ of every palm pair at its stations, 0 where the neighbours move apart, shape (F, N, STATIONS).
    """

    positions: NDArray[np.float64]
    halfway: NDArray[np.float64]
    rotations: NDArray[np.float64]
    flexion_ratio: NDArray[np.float64]
    closing: NDArray[np.float64]


def drive(skeleton: Skeleton, anchors: Anchors, poses: Poses) -> Drivers:
    """Compute all pose inputs of the operators."""
    return Drivers(
        poses.positions,
        halfway_rotations(skeleton, poses.rotations),
        poses.rotations,
        flexion_ratio(skeleton, poses.flexion),
        closing_logarithm(anchors, skeleton.rest, poses.positions),
    )


def halfway_rotations(skeleton: Skeleton, rotations: NDArray[np.float64]) -> NDArray[np.float64]:
    """normalise(q_parent + q_joint): the bisector both segments share (C22, C23). Signs are aligned in the poses."""
    before = np.where(skeleton.parents < 0, np.arange(len(skeleton)), skeleton.parents)
    return unit(rotations[:, before] + rotations)


def flexion_ratio(skeleton: Skeleton, flexion: NDArray[np.float64]) -> NDArray[np.float64]:
    """FR = vertical flexion / maximal flexion, clamped to 0 … 1, shape (F, J) (A §6.1, C18).

    Zero at roots: an angle lies between two segments (R1), and a root has no segment before it.
    """
    largest = skeleton.limits[:, FLEXION, 1]
    moves = (largest > 1e-6) & (skeleton.parents >= 0)
    return np.where(moves, np.clip(flexion / np.where(moves, largest, 1.0), 0.0, 1.0), 0.0)


def initial_ratio(skeleton: Skeleton) -> NDArray[np.float64]:
    """FR of every joint at rest, shape (J,): 0 where the joint is straight at rest (R25)."""
    if skeleton.initial_turns is None:
        return np.zeros(len(skeleton))
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(skeleton), 1))
    return flexion_ratio(skeleton, vertical_flexion(skeleton, still))


def closing_logarithm(
    anchors: Anchors, rest: NDArray[np.float64], positions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """log of λ = final / initial length of the virtual segment where it is below 1, else 0 (A §4, C3, R44)."""
    if not len(anchors.pairs):
        return np.zeros((len(positions), 1, STATIONS))
    now, before = (virtual_lengths(anchors.ends, anchors.pairs, joints) for joints in (positions, rest[None]))
    return np.minimum(np.log(now / before), 0.0)


def virtual_lengths(
    ends: NDArray[np.int32], pairs: NDArray[np.int32], positions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Lengths of the virtual segments that join neighbours [m], at ``STATIONS`` places, shape (F, N, STATIONS) (R42).

    Args:
        ends: Proximal and distal joint of every segment, shape (S, 2).
        pairs: Neighbouring segments, shape (N, 2).
        positions: Joint positions [m], shape (F, J, 3).
    """
    place = np.linspace(0.0, 1.0, STATIONS)[:, None]
    first, second = (ends[pairs[:, k]] for k in (0, 1))
    starts = positions[:, second[:, 0]] - positions[:, first[:, 0]]
    stops = positions[:, second[:, 1]] - positions[:, first[:, 1]]
    across = (1.0 - place) * starts[:, :, None] + place * stops[:, :, None]
    lengths: NDArray[np.float64] = np.maximum(np.linalg.norm(across, axis=-1), 1e-9)
    return lengths
