"""Suggestions to the animator which joint to open, and by how much, to reduce a force (R119).

Derivatives of a digit's force by its joint angles come from the equilibrium's tangent (``contact.sensitivity``), the
stiffening from two instants of one press (``stiffening``).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from warpjld.fem.hand.muscles import JOINT_WORDS, Effort
from warpjld.fem.hand.stiffening import ForceSlope, way_to
from warpjld.skeleton.channels import FLEXION
from warpjld.skeleton.tree import Skeleton

__all__ = ["DigitSlopes", "Suggestion", "suggestions"]

_LEAST = 1e-3
"""Slope, per largest slope of the digit's joints, below which a joint is not suggested."""


@dataclass(frozen=True, eq=False)
class DigitSlopes:
    """A digit's force at an instant, and its derivatives by joint angles.

    Attributes:
        force: The force [N].
        slopes: Derivatives by the flexion of base, knuckle 2 and knuckle 3 [N/rad], shape (3,).
    """

    force: float
    slopes: NDArray[np.float64]


@dataclass(frozen=True)
class Suggestion:
    """Suggested change of one joint.

    Attributes:
        digit: The digit.
        joint: ``base``, ``knuckle 2`` or ``knuckle 3``.
        opening: Angle to open it by [rad].
        wanted: Force after that [N].
        text: ``index 41 N of 59 N; open knuckle 2 by 3.2° for 30 N``.
    """

    digit: str
    joint: str
    opening: float
    wanted: float
    text: str


def suggestions(
    skeleton: Skeleton,
    now: Effort,
    angles: NDArray[np.float64],
    slopes: Mapping[str, DigitSlopes] | None = None,
    before: Mapping[str, DigitSlopes] | None = None,
    *,
    aim: float = 0.5,
    above: float = 1.0,
) -> tuple[Suggestion, ...]:
    """Suggestions for every digit whose share is above a bound.

    The joint is the one that has to turn least and is able to.

    Args:
        skeleton: Names and limits of the joints.
        now: The present effort.
        angles: Joint angles [rad], shape (J, 4).
        slopes: Derivatives of the digits' forces, if known.
        before: The same at an earlier instant of the press, if there is one.
        aim: Wanted share.
        above: Share above which something is suggested.
    """
    out = []
    for digit in now.digits:
        if digit.share <= above:
            continue
        wanted = digit.force * aim / digit.share
        joints = [skeleton.index(f"{digit.digit}.{k}") for k in ("base", "knuckle2", "knuckle3")]
        known = (slopes or {}).get(digit.digit)
        if known is None or not (known.slopes > 0.0).any():
            text = f"{digit.text}; open it or move the hand back for {wanted:.2g} N (no stiffness is known)"
            out.append(Suggestion(digit.digit, "", math.nan, wanted, text))
            continue
        earlier = (before or {}).get(digit.digit)
        opening = np.array([_opening(earlier, known, joint, wanted) for joint in range(3)])
        room = angles[joints, FLEXION] - skeleton.limits[joints, FLEXION, 0]
        possible = np.where(opening <= room, opening, np.inf)
        best = int(np.argmin(possible if np.isfinite(possible).any() else opening))
        text = f"{digit.text}; open {JOINT_WORDS[best]} by {math.degrees(opening[best]):.1f}° for {wanted:.2g} N"
        if not np.isfinite(possible).any():
            text += f" (it can open by {math.degrees(room[best]):.1f}° only: move the hand back)"
        out.append(Suggestion(digit.digit, JOINT_WORDS[best], float(opening[best]), wanted, text))
    return tuple(out)


def _opening(before: DigitSlopes | None, now: DigitSlopes, joint: int, wanted: float) -> float:
    """Angle by which a joint has to open for a wanted force [rad]; infinite if the joint has hardly any effect."""
    slope = float(now.slopes[joint])
    if not slope > _LEAST * float(now.slopes.max()):
        return math.inf
    here, earlier = ForceSlope(now.force, slope), None
    if before is not None and 0.0 < before.force < now.force and before.slopes[joint] > 0.0:
        earlier = ForceSlope(before.force, float(before.slopes[joint]))
    return -way_to(wanted, here, earlier)
