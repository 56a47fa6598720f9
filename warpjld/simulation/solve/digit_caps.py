"""Bounds on the angles by which a digit closes or moves sideways, that vary linearly over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.muscles import KNUCKLES
from warpjld.skeleton import DIGITS, Skeleton
from warpjld.skeleton.channels import ABDUCTION, FLEXION

__all__ = ["AngleRamp", "DigitMotion", "closing_joints", "held_angles", "limited_joints"]


class DigitMotion(NamedTuple):
    """A motion of a digit that forces may limit.

    Attributes:
        actor: Name of the actor.
        digit: Name of its digit in the skeleton.
        sideways: 0 for closing (flexions that increase); 1 or -1 for an abduction that increases or decreases.
    """

    actor: str
    digit: str
    sideways: int = 0

    @property
    def channel(self) -> int:
        """Channel of its angles."""
        return ABDUCTION if self.sideways else FLEXION

    @property
    def sign(self) -> int:
        """1 for angles that increase, -1 for those that decrease."""
        return self.sideways or 1


@dataclass(frozen=True)
class AngleRamp:
    """How far the angles of a digit's joints may go, interpolated linearly between two times.

    Attributes:
        begin, end: The times [frames].
        most: The angles at both times [rad], by joint.
    """

    begin: float
    end: float
    most: Mapping[int, tuple[float, float]]

    def at(self, joint: int, time: float) -> float:
        """How far a joint may go at a time [rad]; constant outside the ramp."""
        first, last = self.most[joint]
        share = (time - self.begin) / (self.end - self.begin) if self.end > self.begin else 1.0
        return first + min(1.0, max(0.0, share)) * (last - first)


def held_angles(
    angles: NDArray[np.float64], ramps: Iterable[tuple[DigitMotion, AngleRamp]], time: float
) -> NDArray[np.float64]:
    """Joint angles [rad], shape (J, 4), limited by the ramps of motions at a time."""
    out = np.array(angles)
    for motion, ramp in ramps:
        channel, sign = motion.channel, motion.sign
        for joint in ramp.most:
            out[joint, channel] = sign * min(sign * out[joint, channel], sign * ramp.at(joint, time))
    return out


def closing_joints(skeleton: Skeleton) -> dict[str, list[int]]:
    """Indices of the joints that close each digit of a skeleton, by name: ``left.index``, …, or ``index``."""
    out: dict[str, list[int]] = {}
    for joint, name in enumerate(skeleton.names):
        digit, _, knuckle = name.rpartition(".")
        if knuckle in KNUCKLES and digit.rpartition(".")[2] in DIGITS:
            out.setdefault(digit, []).append(joint)
    return out


def limited_joints(skeleton: Skeleton, motion: DigitMotion) -> list[int]:
    """Indices of the joints of a motion: those that close a digit, or its base, which moves it sideways."""
    joints = closing_joints(skeleton)[motion.digit]
    return joints[:1] if motion.sideways else joints
