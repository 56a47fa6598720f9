"""What every recording of a hand gives a rig: which hand it is, how its fingers bend, how the rig's joints turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import rotate
from warpjld.skeleton import Skeleton

__all__ = ["IDENTITY", "HandMotion", "HandRecording", "HandTurns", "hand_joints", "root_carried"]

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class HandTurns:
    """How one recorded hand turns the J joints of a rig, K times.

    Attributes:
        joints: Joints of the rig that are this hand's.
        local: Rotations relative to the parent's bone, identity beyond the hand, shape (K, J, 4).
        root: Rotation of a rig that is just this hand, shape (K, 4).
        displacement: Displacement [m] of such a rig's root from rest, shape (K, 3).
        moves: Whether the last two count.
    """

    joints: tuple[int, ...]
    local: NDArray[np.float64]
    root: NDArray[np.float64]
    displacement: NDArray[np.float64]
    moves: bool


class HandMotion(Protocol):
    """A recorded hand of any kind: ``HandTrack`` knows where its joints are, ``ManoTrack`` how they turn."""

    @property
    def side(self) -> str | None:
        """``left`` or ``right``; None where the file does not say."""

    @property
    def times(self) -> NDArray[np.float64]:
        """Times [s], increasing, shape (K,)."""

    @property
    def labels(self) -> tuple[str, ...]:
        """What the file calls each time; empty for frame numbers."""

    @property
    def may_be_mirrored(self) -> bool:
        """Whether the recording may be a mirror image of the hand it states."""

    @property
    def bends(self) -> NDArray[np.float64]:
        """Bends [rad] of the fingers' joints as of a right hand, shape (K, 4, 3)."""

    @property
    def leaning(self) -> str | None:
        """The side that a hand looks like whose bends do not tell."""

    def called(self, side: str) -> HandMotion:
        """The same numbers, taken for those of a hand of this side."""

    def mirrored(self) -> HandMotion:
        """The other hand doing the same."""

    def turns(self, skeleton: Skeleton) -> HandTurns:
        """How the joints of a rig's hand of the same side turn."""


@dataclass(frozen=True, eq=False)
class HandRecording:
    """What a file holds of one hand or two.

    Attributes:
        hands: The hands, at most one of a side; a hand whose side is not known is alone.
        rate: Frames a second.
        notes: What was assumed or bridged, for people to read.
        warnings: What looks wrong.
    """

    hands: tuple[HandMotion, ...]
    rate: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def hand_joints(skeleton: Skeleton, side: str | None) -> dict[str, int]:
    """Joints of a rig's hand by their names without the side."""
    return {name.partition(".")[2]: j for j, name in enumerate(skeleton.names) if name.startswith(f"{side}.")}


def root_carried(
    skeleton: Skeleton, turn: NDArray[np.float64], centre: NDArray[np.float64], moved: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation of the root, and its displacement [m], that turn a rig about a point and move that point.

    Args:
        skeleton: The rig's.
        turn: Rotations, shape (K, 4).
        centre: The point at rest [m], shape (3,).
        moved: Where it goes from there [m], shape (K, 3).
    """
    arm = centre - skeleton.rest[0]
    return turn, arm + moved - rotate(turn, arm)
