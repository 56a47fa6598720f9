"""A grasp to be scored: pose or skin of a hand, and placement of the object."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from warpjld.errors import InputError
from warpjld.grasp.objects import Places
from warpjld.skeleton import Poses, Skeleton, poses_from_angles, poses_from_rotations

__all__ = ["GivenGrasp", "quaternion"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GivenGrasp:
    """A grasp to be scored, in any common frame of hand and object; it has ``angles``, ``turns`` or ``skin``.

    Attributes:
        name: Its name in the file.
        thing: Name or path of the object.
        position: Displacement of the rig's root from rest [m], shape (3,).
        rotation: Rotation of the rig about its root, quaternion x, y, z, w, shape (4,).
        angles: Joint angles [rad], shape (J, 4).
        turns: Rotations of the joints relative to their parents' bones, from rest, shape (J, 4).
        skin: The deformed skin in the rig's vertex order [m], shape (V, 3); ``position`` and ``rotation`` are not used.
        scale: Scale of the object.
        place: Placement of the object.
        friction: Coulomb coefficient; None if the file does not state it.
        mass: Mass of the object at its scale [kg], likewise.
        hand: Name of the hand; empty if the file does not state it.
        message: Remark for the table.
    """

    name: str
    thing: str
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    angles: Array | None = None
    turns: Array | None = None
    skin: NDArray[np.float32] | None = None
    scale: float = 1.0
    place: Places = field(default_factory=Places.of)
    friction: float | None = None
    mass: float | None = None
    hand: str = ""
    message: str = ""

    def poses(self, skeleton: Skeleton) -> Poses | None:
        """The hand's pose, one frame; None if only the skin is known."""
        position = self.position[None]
        if self.angles is not None:
            return poses_from_angles(
                skeleton, self.angles[None], root_position=position, root_rotation=self.rotation[None]
            )
        if self.turns is not None:
            turns = self.turns[None].copy()
            turns[:, 0] = self.rotation
            return poses_from_rotations(skeleton, turns, root_position=position)
        return None


def quaternion(values: Array, what: str) -> Array:
    """Unit quaternion x, y, z, w from a file's w, x, y, z.

    Raises:
        InputError: Not four finite numbers, or a length that differs from 1 by more than 0.001.
    """
    turn = np.asarray(values, dtype=np.float64).ravel()
    length = float(np.linalg.norm(turn))
    if turn.shape != (4,) or not np.isfinite(turn).all() or abs(length - 1.0) > 1e-3:
        raise InputError(f"{what}: want a unit quaternion w, x, y, z, got {turn.tolist()}")
    return turn[[1, 2, 3, 0]] / length
