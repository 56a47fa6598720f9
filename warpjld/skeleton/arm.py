"""The arm as a chain of joints: where its angles bring the hand."""

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
"""How far the shoulder girdle goes along with an arm that reaches, each way (elevation and protraction, of the 30 to
40° that it has: Ludewig et al., J Bone Joint Surg Am 91, 2009)."""
_MOVING = {"clavicle": ("flexion", "abduction"), "shoulder": ("flexion", "twisting", "abduction")}
_MOVING |= {"elbow": ("flexion", "twisting"), "wrist": ("flexion", "abduction")}


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm from its girdle to its wrist, on a body that stands still.

    Attributes:
        skeleton: The body's.
        joints: Numbers along the chain, the first below ``base``, the last the wrist.
        base: Joint that carries the chain.
        shoulder, elbow, wrist: Places of these in ``joints``.
        free: Rows (place in ``joints``, channel) of the angles that move the arm, shape (n, 2).
        limits: Their smallest and largest values [rad], shape (n, 2).
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
        """From the shoulder over the elbow to the wrist [m]."""
        rest = self.skeleton.rest[list(self.joints)]
        return float(np.linalg.norm(np.diff(rest[self.shoulder :], axis=0), axis=1).sum())

    def values(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """The arm's own angles [rad], shape (n,), of those of the skeleton (J, 4)."""
        joints = np.asarray(self.joints)[self.free[:, 0]]
        return np.asarray(angles[joints, self.free[:, 1]])

    def posed(self, angles: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Angles of the skeleton (J, 4) with those of the arm (n,) put in."""
        out = angles.copy()
        out[np.asarray(self.joints)[self.free[:, 0]], self.free[:, 1]] = values
        return out

    def chains(
        self, angles: NDArray[np.float64], values: NDArray[np.float64], body: Poses
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Joints of the arm for B sets of its angles.

        Args:
            angles: Of the skeleton, for those of the chain that do not move [rad], shape (J, 4).
            values: Of the arm [rad], shape (B, n).
            body: One pose that says where the body is.

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
        """A point of the posed hand [m] as an offset from the wrist in its bone's rest axes, shape (3,): it goes where
        the wrist goes while the hand's own angles stay."""
        wrist = self.joints[-1]
        local = rotate(conjugate(body.rotations[0, wrist]), point - body.positions[0, wrist])
        return np.asarray(local)


def arm_of(skeleton: Skeleton, side: str) -> Arm:
    """The arm of a side: clavicle where there is one, shoulder, elbow, wrist, and whatever lies between them.

    Raises:
        InputError: There is no shoulder, elbow or wrist.
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
        raise InputError(f"no {side} arm: its wrist does not hang on its shoulder, or the shoulder on nothing")
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
