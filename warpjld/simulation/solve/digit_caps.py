"""Upper bounds on the flexions of a digit that vary linearly over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.muscles import KNUCKLES
from warpjld.skeleton import DIGITS, Skeleton
from warpjld.skeleton.channels import FLEXION

__all__ = ["FlexionRamp", "closing_joints", "held_angles"]


@dataclass(frozen=True)
class FlexionRamp:
    """Largest flexions of a digit's joints, interpolated linearly between two times.

    Attributes:
        begin, end: The times [frames].
        most: Largest flexions at both times [rad], by joint.
    """

    begin: float
    end: float
    most: Mapping[int, tuple[float, float]]

    def at(self, joint: int, time: float) -> float:
        """Largest flexion of a joint at a time [rad]; constant outside the ramp."""
        first, last = self.most[joint]
        share = (time - self.begin) / (self.end - self.begin) if self.end > self.begin else 1.0
        return first + min(1.0, max(0.0, share)) * (last - first)


def held_angles(angles: NDArray[np.float64], ramps: Iterable[FlexionRamp], time: float) -> NDArray[np.float64]:
    """Joint angles [rad], shape (J, 4), with flexions limited by ramps at a time."""
    out = np.array(angles)
    for ramp in ramps:
        for joint in ramp.most:
            out[joint, FLEXION] = min(out[joint, FLEXION], ramp.at(joint, time))
    return out


def closing_joints(skeleton: Skeleton) -> dict[str, list[int]]:
    """Indices of the joints that close each digit of a skeleton, by name: ``left.index``, …, or ``index``."""
    out: dict[str, list[int]] = {}
    for joint, name in enumerate(skeleton.names):
        digit, _, knuckle = name.rpartition(".")
        if knuckle in KNUCKLES and digit.rpartition(".")[2] in DIGITS:
            out.setdefault(digit, []).append(joint)
    return out
