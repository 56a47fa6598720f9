"""Common interface of hand recordings: side, finger bends, and joint rotations for a rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import rotate, slerp
from warpjld.skeleton import Skeleton

__all__ = ["IDENTITY", "HandMotion", "HandPart", "HandRecording", "HandTurns", "hand_joints", "root_carried"]

IDENTITY = np.array([0.0, 0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class HandPart:
    """Rotations of a rig's J joints by one recorded hand, at k of its times.

    Attributes:
        local: Rotations relative to the parent's bone, identity for joints outside the hand, shape (k, J, 4).
        root: Rotation of the root of a rig that consists of this hand, shape (k, 4).
        displacement: Displacement [m] of such a rig's root from rest, shape (k, 3).
    """

    local: NDArray[np.float64]
    root: NDArray[np.float64]
    displacement: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HandTurns:
    """Rotations of a rig's joints by one recorded hand.

    Attributes:
        joints: Joints of the rig that belong to the hand.
        moves: Whether the root's rotation and displacement are known.
        part: Function that computes the rotations at a range of the hand's times.
    """

    joints: tuple[int, ...]
    moves: bool
    part: Callable[[slice], HandPart]

    def at(self, times: NDArray[np.float64], wanted: NDArray[np.float64]) -> HandPart:
        """Rotations at increasing times, interpolated between the hand's times [s], shape (K,), constant outside."""
        last = int(np.searchsorted(times, wanted[-1], side="right")) + 1
        first = min(max(int(np.searchsorted(times, wanted[0], side="right")) - 1, 0), max(len(times) - 2, 0))
        span = slice(first, max(last, first + 2))
        there, when = self.part(span), times[span]
        displacement = np.stack([np.interp(wanted, when, column) for column in there.displacement.T], axis=-1)
        return HandPart(slerp(when, there.local, wanted), slerp(when, there.root, wanted), displacement)


class HandMotion(Protocol):
    """A recorded hand: ``HandTrack`` holds joint positions, ``ManoTrack`` joint rotations."""

    @property
    def side(self) -> str | None:
        """``left`` or ``right``; None if the file does not state it."""

    @property
    def times(self) -> NDArray[np.float64]:
        """Times [s], increasing, shape (K,)."""

    @property
    def labels(self) -> tuple[str, ...]:
        """The file's name of each time, for messages; empty for frame numbers."""

    @property
    def may_be_mirrored(self) -> bool:
        """Whether the recording may be a mirror image of the stated hand."""

    @property
    def bends(self) -> NDArray[np.float64]:
        """Bends [rad] of the finger joints for a right hand, shape (K, 4, 3)."""

    @property
    def leaning(self) -> str | None:
        """Probable side of a hand whose bends are not conclusive."""

    def called(self, side: str) -> HandMotion:
        """The same data, taken as those of a hand of this side."""

    def mirrored(self) -> HandMotion:
        """The mirror image: the other hand with the same motion."""

    def turns(self, skeleton: Skeleton) -> HandTurns:
        """Rotations of the joints of a rig's hand of the same side."""


@dataclass(frozen=True, eq=False)
class HandRecording:
    """Content of a recording of one or two hands.

    Attributes:
        hands: The hands, at most one per side; a hand of unknown side is the only one.
        rate: Frames a second.
        notes: Assumptions and interpolated gaps, for the user.
        warnings: What looks wrong.
    """

    hands: tuple[HandMotion, ...]
    rate: float
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def hand_joints(skeleton: Skeleton, side: str | None) -> dict[str, int]:
    """Joint indices of a rig's hand, by names without the side."""
    return {name.partition(".")[2]: j for j, name in enumerate(skeleton.names) if name.startswith(f"{side}.")}


def root_carried(
    skeleton: Skeleton, turn: NDArray[np.float64], centre: NDArray[np.float64], moved: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rotation and displacement [m] of a rig's root that rotate the rig about a point and move that point.

    Args:
        skeleton: The rig's skeleton.
        turn: Rotations, shape (K, 4).
        centre: The point at rest [m], shape (3,).
        moved: Displacement of the point [m], shape (K, 3).
    """
    arm = centre - skeleton.rest[0]
    return turn, arm + moved - rotate(turn, arm)
