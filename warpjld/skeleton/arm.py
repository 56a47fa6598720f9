"""The arm as a kinematic chain: forward kinematics from girdle to wrist, batched over sets of angles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.geometry.rotations import conjugate, multiply, rotate
from warpjld.skeleton.kinematics import Poses, joint_rotations
from warpjld.skeleton.tree import CHANNELS, Skeleton

__all__ = ["Arm", "arm_of"]

_CLAVICLE = np.radians(20.0)
"""Largest rotation of the shoulder girdle in reaching, each way (elevation and protraction, of a range of 30 to 40°:
Ludewig et al., J Bone Joint Surg Am 91, 2009)."""
_MOVING = {"clavicle": ("flexion", "abduction"), "shoulder": ("flexion", "twisting", "abduction")}
_MOVING |= {"elbow": ("flexion", "twisting"), "wrist": ("flexion", "abduction")}


@dataclass(frozen=True, eq=False)
class Arm:
    """A kinematic chain from shoulder girdle to wrist, on a body that does not move.

    Attributes:
        skeleton: The body's skeleton.
        joints: Joint indices along the chain, the first a child of ``base``, the last the wrist.
        base: Parent joint of the chain.
        shoulder, elbow, wrist: Positions of these joints in ``joints``.
        free: Degrees of freedom: rows (position in ``joints``, channel), shape (n, 2).
        limits: Smallest and largest value of each degree of freedom [rad], shape (n, 2).
    """

    skeleton: Skeleton
    joints: tuple[int, ...]
    base: int
    shoulder: int
    elbow: int
    wrist: int
    free: NDArray[np.int64]
    limits: NDArray[np.float64]

    @cached_property
    def length(self) -> float:
        """Length from shoulder over elbow to wrist [m]."""
        rest = self.skeleton.rest[list(self.joints)]
        return float(np.linalg.norm(np.diff(rest[self.shoulder :], axis=0), axis=1).sum())

    def values(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of the degrees of freedom [rad], shape (n,), in the skeleton's angles (J, 4)."""
        joints = np.asarray(self.joints)[self.free[:, 0]]
        return np.asarray(angles[joints, self.free[:, 1]])

    def posed(self, angles: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """A copy of the skeleton's angles (J, 4) with the degrees of freedom set to ``values`` (n,)."""
        out = angles.copy()
        out[np.asarray(self.joints)[self.free[:, 0]], self.free[:, 1]] = values
        return out

    def chains(
        self, angles: NDArray[np.float64], values: NDArray[np.float64], body: Poses
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Joint positions and rotations of the chain for B sets of values.

        Args:
            angles: The skeleton's angles, used for joints of the chain that are not free [rad], shape (J, 4).
            values: Degrees of freedom [rad], shape (B, n).
            body: A single pose that places ``base``.

        Returns:
            Positions [m], shape (B, K, 3), and rotations from rest, quaternions x, y, z, w, shape (B, K, 4).
        """
        chain = list(self.joints)
        own = np.repeat(angles[chain][None], len(values), axis=0)
        own[:, self.free[:, 0], self.free[:, 1]] = values
        local = joint_rotations(self.skeleton, own, joints=np.array(chain))
        rest = self.skeleton.rest
        turn = np.repeat(body.rotations[:1, self.base], len(values), axis=0)
        at = np.repeat(body.positions[:1, self.base], len(values), axis=0)
        positions, rotations = np.empty((len(values), len(chain), 3)), np.empty((len(values), len(chain), 4))
        before = self.base
        for k, joint in enumerate(chain):
            at = at + rotate(turn, rest[joint] - rest[before])
            turn = multiply(turn, local[:, k])
            positions[:, k], rotations[:, k], before = at, turn, joint
        return positions, rotations

    def carried(self, point: NDArray[np.float64], body: Poses) -> NDArray[np.float64]:
        """A point of the posed hand [m] in the rest axes of the wrist's bone, relative to the wrist, shape (3,).

        It is constant while the angles of the hand itself do not change.
        """
        wrist = self.joints[-1]
        local = rotate(conjugate(body.rotations[0, wrist]), point - body.positions[0, wrist])
        return np.asarray(local)


def arm_of(skeleton: Skeleton, side: str) -> Arm:
    """The chain of one arm: clavicle (if there is one), shoulder, elbow, wrist, and all joints between them.

    Raises:
        InputError: Shoulder, elbow or wrist is missing, or the wrist is no descendant of the shoulder.
    """
    places = {name: k for k, name in enumerate(skeleton.names)}
    missing = [name for name in ("shoulder", "elbow", "wrist") if f"{side}.{name}" not in places]
    if missing:
        raise InputError(f"no {side} arm: this skeleton has no {', '.join(f'{side}.{name}' for name in missing)}")
    top = places.get(f"{side}.clavicle", places[f"{side}.shoulder"])
    chain: list[int] = []
    joint = places[f"{side}.wrist"]
    while joint >= 0:
        chain.insert(0, joint)
        if joint == top:
            break
        joint = int(skeleton.parents[joint])
    if joint < 0 or skeleton.parents[top] < 0:
        raise InputError(
            f"no {side} arm: its wrist must be a descendant of its shoulder, and the shoulder must have a parent"
        )
    rows, limits = [], []
    for k, number in enumerate(chain):
        for channel in _MOVING.get(skeleton.names[number].rpartition(".")[2], ()):
            column = CHANNELS.index(channel)
            low, high = skeleton.limits[number, column]
            if number == top and top != places[f"{side}.shoulder"]:
                low, high = max(low, -_CLAVICLE), min(high, _CLAVICLE)
            if high - low > 1e-6:
                rows.append((k, column))
                limits.append((low, high))
    shoulder, elbow, wrist = (chain.index(places[f"{side}.{name}"]) for name in ("shoulder", "elbow", "wrist"))
    base = int(skeleton.parents[top])
    return Arm(skeleton, tuple(chain), base, shoulder, elbow, wrist, np.array(rows), np.array(limits))
