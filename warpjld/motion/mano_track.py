"""Retargeting of a hand, given by MANO's joint rotations, to a rig's hand."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from warpjld.geometry.rotations import about, conjugate, multiply, rotate
from warpjld.motion.finger_bends import finger_bends
from warpjld.motion.hand_motion import IDENTITY, HandPart, HandTurns, hand_joints, root_carried
from warpjld.motion.mano_rest import MANO_DIGITS, ManoRest, mano_rest
from warpjld.skeleton import Skeleton
from warpjld.skeleton.hand import FINGER_JOINTS
from warpjld.skeleton.streamed_poses import BLOCK

__all__ = ["ManoTrack"]


@dataclass(frozen=True, eq=False)
class ManoTrack:
    """Rotations of a hand's joints at K times, from the flat hand.

    Attributes:
        side: ``left`` or ``right``; None if the file does not state it.
        times: Times [s], increasing, shape (K,).
        pose: Axis-angle vectors [rad] in MANO's axes, relative to the parent, in MANO's order, shape (K, 15, 3).
        orient: Rotation of the wrist, shape (K, 3); None without.
        place: Position of the hand [m], shape (K, 3); None without.
        in_rig: Whether orientation and position are in a rig's own axes and from its origin, as ``write_mano`` writes
            them; those of other files are in camera axes, and only changes from their first frame are used.
        labels: The file's name of each time, for messages.
    """

    side: str | None
    times: NDArray[np.float64]
    pose: NDArray[np.float64]
    orient: NDArray[np.float64] | None = None
    place: NDArray[np.float64] | None = None
    in_rig: bool = False
    labels: tuple[str, ...] = ()

    @property
    def may_be_mirrored(self) -> bool:
        """False: rotations belong to the side they state."""
        return False

    @property
    def leaning(self) -> str | None:
        """None: a flat hand's rotations do not show its side."""
        return None

    @cached_property
    def bends(self) -> NDArray[np.float64]:
        """Bends [rad] of the finger joints for a right hand, shape (K, 4, 3), from MANO's rest hand with unit bones."""
        starts = range(0, max(len(self.times), 1), BLOCK)
        return np.concatenate([_bends(self.pose[start : start + BLOCK]) for start in starts])

    def called(self, side: str) -> ManoTrack:
        """The same data, taken as those of a hand of this side."""
        return replace(self, side=side)

    def mirrored(self) -> ManoTrack:
        """The mirror image: mirroring in the plane x = 0 changes the signs of a rotation vector's y and z."""
        turned = np.array([1.0, -1.0, -1.0])
        return replace(
            self,
            side="right" if self.side == "left" else "left",
            pose=self.pose * turned,
            orient=None if self.orient is None else self.orient * turned,
            place=None if self.place is None else self.place * -turned,
            in_rig=False,
        )

    def turns(self, skeleton: Skeleton) -> HandTurns:
        """Rotations of the joints of a rig's hand of the same side.

        With R the rotation of a joint's bone from the flat hand, in the wrist's axes, W the rotation from MANO's axes
        to the rig's and A the rotation of the rig's rest bone to the flat hand, the rig's bone is rotated by

            Q = W R Wᵀ A

        relative to its wrist: zero rotations give the flat hand, and twist is preserved.

        Raises:
            InputError: The rig's hand has no palm.
        """
        side = self.side or ""
        own, rest = hand_joints(skeleton, side), mano_rest(skeleton, side)
        wrist = skeleton.rest[own["wrist"]]
        first = None if self.in_rig else (self._palm(slice(0, 1), rest.axes)[0], self._place(slice(0, 1))[0])

        def part(times: slice) -> HandPart:
            palm, place = self._palm(times, rest.axes), self._place(times)
            if first is None:
                turn, moved = palm, place - wrist
            else:
                back = conjugate(first[0])
                turn, moved = multiply(back, palm), rotate(back, place - first[1])
            return HandPart(self._local(times, skeleton, rest), *root_carried(skeleton, turn, wrist, moved))

        moves = self.orient is not None or self.place is not None
        return HandTurns(tuple(own.values()), moves, part)

    def _palm(self, times: slice, axes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rotations of the wrist from the rig's axes, shape (k, 4)."""
        count = len(self.times[times])
        return multiply(about(np.zeros((count, 3)) if self.orient is None else self.orient[times]), conjugate(axes))

    def _place(self, times: slice) -> NDArray[np.float64]:
        return np.zeros((len(self.times[times]), 3)) if self.place is None else self.place[times]

    def _local(self, times: slice, skeleton: Skeleton, rest: ManoRest) -> NDArray[np.float64]:
        """Rotations of all joints relative to their parents' bones, shape (k, J, 4)."""
        count = len(self.times[times])
        local = np.tile(IDENTITY, (count, len(skeleton), 1))
        turned = about(self.pose[times])
        for d in range(len(MANO_DIGITS)):
            world = np.tile(IDENTITY, (count, 1))
            before = world
            for m in range(3 * d, 3 * d + 3):
                world = multiply(world, turned[:, m])
                if rest.joints[m] >= 0:
                    bone = multiply(multiply(multiply(rest.axes, world), conjugate(rest.axes)), rest.align[m])
                    local[:, rest.joints[m]] = multiply(conjugate(before), bone)
                    before = bone
        return local


def _bends(pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bends [rad] at k times, shape (k, 4, 3), from axis-angle vectors, shape (k, 15, 3)."""
    count = len(pose)
    points = {"wrist": np.zeros((count, 3))}
    turns = about(pose).reshape(count, len(MANO_DIGITS), 3, 4)
    for d, digit in enumerate(MANO_DIGITS[:-1]):
        across = {"index": 1.0, "middle": 0.0, "ring": -1.0, "pinky": -2.0}[digit]
        at = np.tile([-4.0, 0.0, across], (count, 1))
        turn = np.tile(IDENTITY, (count, 1))
        points[f"{digit}.carpometacarpal"] = at + np.array([3.0, 0.0, 0.0])
        for k, joint in enumerate(FINGER_JOINTS):
            points[f"{digit}.{joint}"] = at
            if k < 3:
                turn = multiply(turn, turns[:, d, k])
                at = at + rotate(turn, [-1.0, 0.0, 0.0])
    return finger_bends(points)
